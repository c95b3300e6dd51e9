// The bridge as the simulation steps it: its inputs lie in registers, so that a clock edge is all there is to evaluate.
// An edge of `clk` ends a cycle with the inputs given for it and begins the next one with the inputs as they are at the
// edge; the outputs then are those of that next cycle. MISO lines answer to the outputs of their own cycle: they come in
// without a register.

`default_nettype none

module clocked_bridge (
    input  wire        clk,
    input  wire        rst,               // power-up
    output wire        sync,              // to the nodes
    output wire        sck,               // .
    output wire        select_n,          // .
    output wire        mosi,              // .
    input  wire [27:0] miso,              // .
    input  wire [7:0]  utmi_rx_data,      // to and from the host
    input  wire        utmi_rx_active,    // .
    input  wire        utmi_rx_valid,     // .
    output wire [7:0]  utmi_tx_data,      // .
    output wire        utmi_tx_valid,     // .
    input  wire        utmi_tx_ready,     // .
    input  wire [1:0]  utmi_line_state,   // .
    output wire [1:0]  utmi_xcvr_select,  // .
    output wire        utmi_term_select,  // .
    output wire [1:0]  utmi_op_mode,      // .
    input  wire        tick_external,
    input  wire        tick_strobe,
    output wire        running,
    output wire        link_busy,
    output wire        flash_cs_n,        // configuration flash
    output wire        flash_sck,         // .
    output wire        flash_mosi,        // .
    input  wire        flash_miso         // .
);
    reg       reset, active, valid, ready, external, strobe;
    reg [7:0] data;
    reg [1:0] line;

    always @(posedge clk) begin
        reset    <= rst;
        active   <= utmi_rx_active;
        valid    <= utmi_rx_valid;
        ready    <= utmi_tx_ready;
        data     <= utmi_rx_data;
        line     <= utmi_line_state;
        external <= tick_external;
        strobe   <= tick_strobe;
    end

    whisker_bridge #(.FLASH_SECTORS(8'd4)) bridge (
        .clk(clk), .rst(reset), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi), .miso(miso),
        .utmi_rx_data(data), .utmi_rx_active(active), .utmi_rx_valid(valid), .utmi_rx_error(1'b0),
        .utmi_tx_data(utmi_tx_data), .utmi_tx_valid(utmi_tx_valid), .utmi_tx_ready(ready), .utmi_line_state(line),
        .utmi_vbus_valid(1'b1), .utmi_session_valid(1'b1), .utmi_session_end(1'b0),
        .utmi_xcvr_select(utmi_xcvr_select), .utmi_term_select(utmi_term_select), .utmi_op_mode(utmi_op_mode),
        .serial_number(64'd0), .tick_external(external), .tick_strobe(strobe), .tick_in(1'b0), .tick_out(),
        .running(running), .link_busy(link_busy), .transfer_busy(), .usb_configured(), .frames_lost(), .led(),
        .flash_cs_n(flash_cs_n), .flash_sck(flash_sck), .flash_mosi(flash_mosi), .flash_miso(flash_miso));
endmodule

`default_nettype wire
