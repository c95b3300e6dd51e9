// UTMI on one side, a ULPI PHY's pins on the other (ULPI 1.1; the PHY gives the 60 MHz clock and keeps it running).
// ulpi_data_out and ulpi_stp are flip-flops at the pads, and all inputs end in flip-flops; the only logic before one is the
// choice that ulpi_nxt and ulpi_dir make, for the PHY wants the next byte in the very next cycle. The board's pads let go of
// the bus by themselves while dir is high and in the cycle after it.
//
//   dir nxt data_in --> | reg | --> rx: RXCMD or byte --> line_state, session, rx_active, rx_valid, rx_error
//   data_out stp    <-- | reg | <-- IDLE -> COMMAND -> VALUE | BYTES -> STOP <-- set-up list, then every change of mode
//                                                                       '---- four bytes ahead <-- tx_data, tx_valid
//
// Set-up: once dir has been low for SETTLE cycles: soft reset, wait for its end, pull-downs off, a register of the PHY's
// maker if the board wants one (a board may have D+ and D- swapped, for the PHY to swap back), mode. Until then the
// session has ended for the device, so that it neither chirps nor answers. A command without nxt for TIMEOUT cycles ends
// with stp; a set-up then begins anew. dir ends a register write (tried again) or a transmission (dropped, as is one that
// has not begun when the next packet comes: its time is over).

`default_nettype none

module ulpi_shim #(
    parameter       SETTLE          = 64,    // cycles of dir low before a command, at first and after a reset or a time-out
    parameter       TIMEOUT         = 1024,  // cycles without nxt; a full-speed byte takes 47 at most
    parameter       IGNORE_VBUS     = 0,     // 1: the PHY does not see VBUS; a session always lasts
    parameter [5:0] VENDOR_REGISTER = 6'h00, // 30 to 3F: a register of the PHY's maker to be written in the set-up; 0: none
    parameter [7:0] VENDOR_VALUE    = 8'h00  // what to write there
) (
    input  wire       clk,                 // 60 MHz, from the PHY
    input  wire       rst,                 // synchronous, power-up
    input  wire [7:0] ulpi_data_in,        // pads
    output reg  [7:0] ulpi_data_out,       // .
    input  wire       ulpi_dir,            // .
    input  wire       ulpi_nxt,            // .
    output reg        ulpi_stp,            // .
    output wire       ready,               // the PHY is set up
    output reg  [7:0] utmi_rx_data,        // UTMI, as its specification names it
    output reg        utmi_rx_active,      // .
    output reg        utmi_rx_valid,       // .
    output reg        utmi_rx_error,       // .
    input  wire [7:0] utmi_tx_data,        // .
    input  wire       utmi_tx_valid,       // .
    output wire       utmi_tx_ready,       // .
    output reg  [1:0] utmi_line_state,     // .
    output wire       utmi_vbus_valid,     // .
    output wire       utmi_session_valid,  // .
    output wire       utmi_session_end,    // .
    input  wire [1:0] utmi_xcvr_select,    // .
    input  wire       utmi_term_select,    // .
    input  wire [1:0] utmi_op_mode         // .
);
    // ULPI 1.1: transmit command byte (3.8.1.1), function control (4.2.2), OTG control (4.2.4)
    localparam [7:0] TRANSMIT = 8'h40, WRITE_FUNCTION = 8'h84, WRITE_OTG = 8'h8A;
    localparam [7:0] WRITE_VENDOR = {2'b10, VENDOR_REGISTER};
    localparam [7:0] SOFT_RESET = 8'h65;  // reset, suspendM high, full speed
    localparam [7:0] NO_PULL_DOWNS = 8'h00;
    localparam [1:0] OP_MODE_CHIRP = 2'd2;

    localparam [2:0] REST = 3'd0, IDLE = 3'd1, COMMAND = 3'd2, VALUE = 3'd3, BYTES = 3'd4, STOP = 3'd5;
    localparam [2:0] STEP_RESET = 3'd0, STEP_OTG = 3'd1, STEP_VENDOR = 3'd2, STEP_MODE = 3'd3, STEP_DONE = 3'd4;
    localparam [2:0] AFTER_OTG = VENDOR_REGISTER != 6'h00 ? STEP_VENDOR : STEP_MODE;

    reg [2:0]  state;
    reg [2:0]  step;      // of the set-up
    reg        writing;   // the command is a register write
    reg        failed;    // it ran out of time
    reg [7:0]  value;     // of the register write
    reg [7:0]  mode;      // function control as last written
    reg [10:0] patience;  // cycles left

    // ---------------------------------------------------------------------------------------------- from the PHY
    reg       dir, dir_before, nxt;
    reg [7:0] data;
    reg [1:0] line, vbus;

    wire heard  = dir && dir_before;    // else it is idle, or a turnaround
    wire status = heard && !nxt;        // RXCMD, ULPI 1.1 section 3.8.1.2
    wire active = status ? data[4] : dir && (utmi_rx_active || nxt);  // dir and nxt rising together begin a packet

    always @(posedge clk) begin
        {dir_before, dir, nxt, data} <= {dir, ulpi_dir, ulpi_nxt, ulpi_data_in};
        utmi_rx_data    <= data;
        utmi_rx_valid   <= ready && heard && nxt;
        utmi_rx_active  <= ready && active;
        utmi_rx_error   <= ready && status && data[5:4] == 2'b11;
        utmi_line_state <= ready ? line : 2'b00;
        if (status) {vbus, line} <= data[3:0];
        if (rst) {dir_before, dir, nxt, vbus, line} <= {1'b1, 1'b1, 1'b0, 2'b11, 2'b00};
    end

    assign ready              = step == STEP_DONE;
    assign utmi_vbus_valid    = ready && (vbus == 2'b11 || IGNORE_VBUS != 0);
    assign utmi_session_valid = ready && (vbus[1] || IGNORE_VBUS != 0);
    assign utmi_session_end   = !ready || (vbus == 2'b00 && IGNORE_VBUS == 0);

    // --------------------------------------------------------------------------- what the device sends, four bytes ahead
    reg [7:0] ahead [0:3];
    reg [1:0] head, tail;
    reg [2:0] count;
    reg       drop;  // the rest of its packet goes nowhere

    wire       push      = utmi_tx_valid && utmi_tx_ready && !drop;
    wire       more      = count != 3'd0;
    wire [7:0] next_byte = ahead[tail];
    wire       chirp     = utmi_op_mode == OP_MODE_CHIRP;  // no identifier: all bytes follow the command

    wire [7:0] mode_due  = {3'b010, utmi_op_mode, utmi_term_select, utmi_xcvr_select};
    wire       write_due = !ready || mode != mode_due;
    wire       may_begin = !dir && !dir_before && (write_due || more && !drop);
    wire       begins    = state == IDLE && may_begin && !ulpi_dir && !write_due;
    wire       in_packet = !writing && (state == COMMAND || state == BYTES);
    wire       pop       = more && (begins ? !chirp : in_packet && ulpi_nxt && !ulpi_dir);
    wire       in_command = state == COMMAND || state == VALUE || state == BYTES;
    wire       expired   = in_command && patience == 11'd0;
    wire       aborted   = in_command && ulpi_dir;

    assign utmi_tx_ready = ready && (drop || !count[2]);

    always @(posedge clk) begin
        if (push) ahead[head] <= utmi_tx_data;
        head  <= head + {1'b0, push};
        tail  <= tail + {1'b0, pop};
        count <= count + {2'b00, push} - {2'b00, pop};
        drop  <= drop && utmi_tx_valid;
        if ((aborted || expired) && !writing || utmi_rx_active && !in_command) begin
            {head, tail, count} <= 7'd0;
            drop <= utmi_tx_valid;
        end
        if (rst) {head, tail, count, drop} <= 8'd0;
    end

    // ------------------------------------------------------------------------------------------------------ to the PHY
    wire [7:0] due_value   = step == STEP_RESET  ? SOFT_RESET
                           : step == STEP_OTG    ? NO_PULL_DOWNS
                           : step == STEP_VENDOR ? VENDOR_VALUE : mode_due;
    wire [7:0] due_command = step == STEP_OTG ? WRITE_OTG : step == STEP_VENDOR ? WRITE_VENDOR : WRITE_FUNCTION;

    wire [7:0] first     = write_due ? due_command : TRANSMIT | (chirp ? 8'h00 : {4'h0, next_byte[3:0]});
    wire [7:0] following = writing ? (state == COMMAND ? value : 8'h00) : more ? next_byte : 8'h00;

    always @(posedge clk)
        if (rst || expired) ulpi_data_out <= 8'h00;
        else if (!in_command) ulpi_data_out <= state == IDLE && may_begin ? first : 8'h00;
        else if (ulpi_nxt) ulpi_data_out <= following;

    always @(posedge clk) begin
        ulpi_stp <= 1'b0;
        patience <= patience - 11'd1;
        case (state)
            REST: begin
                if (ulpi_dir || dir) patience <= SETTLE;
                else if (patience == 11'd0) state <= IDLE;
            end
            IDLE: begin
                patience <= TIMEOUT;
                failed   <= 1'b0;
                writing  <= write_due;
                value    <= due_value;
                if (may_begin && !ulpi_dir) state <= COMMAND;
            end
            COMMAND, VALUE, BYTES:
                if (aborted || expired) begin
                    state    <= aborted ? IDLE : STOP;
                    failed   <= 1'b1;
                    ulpi_stp <= !aborted;
                end else if (ulpi_nxt) begin
                    patience <= TIMEOUT;
                    state    <= !writing ? (more ? BYTES : STOP) : state == COMMAND ? VALUE : STOP;
                    ulpi_stp <= writing ? state == VALUE : !more;
                end
            STOP: begin
                patience <= SETTLE;
                state    <= failed || step == STEP_RESET ? REST : IDLE;
                if (writing && failed && !ready) step <= STEP_RESET;
                else if (writing && !failed && !ulpi_dir) begin
                    if (step >= STEP_MODE) mode <= value;
                    if (!ready) step <= step == STEP_OTG ? AFTER_OTG : step + 3'd1;
                end
            end
            default: state <= REST;
        endcase
        if (rst) begin
            {state, step, ulpi_stp} <= {REST, STEP_RESET, 1'b0};
            {writing, failed, mode} <= 10'd0;
            patience <= SETTLE;
        end
    end
endmodule

`default_nettype wire
