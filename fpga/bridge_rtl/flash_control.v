// Reads and writes the FPGA's configuration flash, an order at a time: HID report `flash`. Flash that SECTORS does not cover is
// never erased or programmed, whatever the host sends: the image that the FPGA falls back to lies there. Orders are refused
// while a run is in progress. The report's address and data lie in a memory that the order's bytes come from and go to.
//
//   write bytes --> memory, [ in limits? ]--accept--> enable, opcode + address + data, status until not busy --> flash
//                     '--> data, data, ..  (report_reader)
//
// A bit takes 8 cycles, SCK high in the second four; MISO is read at their end, so its way there and back may take 90 ns. SCK leaves
// at the clock's other edge: its way to the cell of the flash's clock pin is long, and so is distinguished from the ways to the PHY.

`default_nettype none

module flash_control #(
    parameter [7:0] SECTORS = 8'd1  // of 64 KiB from address 0 on, which may be written
) (
    input  wire       clk,           // 60 MHz
    input  wire       rst,           // synchronous, power-up
    input  wire       running,       // a run is in progress
    input  wire       write_start,   // a report is to come: forget what was gathered
    input  wire       write_valid,   // write_data is a byte of a report
    input  wire [5:0] write_index,   // its place
    input  wire [7:0] write_data,    // the byte
    input  wire       write_done,    // the report is complete: accept it or refuse it in this cycle
    output wire       write_accept,  // it is acceptable
    input  wire       read_start,    // a read begins: data is the report's address from the next cycle on
    input  wire       read_next,     // data is taken: show the next byte
    output wire [7:0] read_data,     // byte of the report
    output reg  [1:0] command,       // of the latest order
    output wire       busy,          // it is under way
    output reg        flash_cs_n,    // pins
    output reg        flash_sck,     // .
    output reg        flash_mosi,    // .
    input  wire       flash_miso     // .
);
    `include "whisker_protocol.vh"

    localparam [7:0] OPCODE_ENABLE = 8'h06, OPCODE_STATUS = 8'h05, OPCODE_IDENTIFY = 8'h9F, OPCODE_READ = 8'h03;
    localparam [7:0] OPCODE_ERASE = 8'h20, OPCODE_PROGRAM = 8'h02;
    localparam [1:0] IDENTIFY = FLASH_COMMAND_IDENTIFY[1:0], READ = FLASH_COMMAND_READ[1:0];
    localparam [1:0] ERASE = FLASH_COMMAND_ERASE[1:0], PROGRAM = FLASH_COMMAND_PROGRAM[1:0];
    localparam [5:0] ADDRESS = REPORT_FLASH_ADDRESS[5:0], DATA = REPORT_FLASH_DATA[5:0];
    localparam [5:0] SENT_FIRST = ADDRESS + 6'd2, IDENTITY_END = DATA + 6'd2, DATA_END = REPORT_FLASH_BYTES[5:0] - 6'd1;

    localparam [2:0] IDLE = 3'd0, LOAD = 3'd1, SHIFT = 3'd2, STORE = 3'd3, PAUSE = 3'd4;
    localparam [1:0] ENABLING = 2'd0, WORKING = 2'd1, ASKING = 2'd2;

    // The report, as it is gathered.
    reg [7:0] memory [0:63];
    reg       ours, version, known, aligned, reached, whole;
    reg       right;     // a cycle ago: the report takes longer
    reg [1:0] asked;
    wire      first = (write_index == 6'd0);
    wire      take  = write_valid && !busy && (first ? write_data == REPORT_ID_FLASH[7:0] : ours);

    // The order under way.
    reg  [2:0] state;
    reg  [1:0] step;     // of the order: a transaction with the flash each
    reg        opcode;   // the transaction's first byte is under way
    reg  [5:0] beat;     // of a byte: bit, and eighth of it; in a pause, how long
    reg  [5:0] index;    // place of the byte in the report
    reg  [7:0] shift;
    reg        miso, sck;
    wire       begins    = write_done && write_accept;
    wire       writes    = command[1];
    wire       in_order  = opcode || index < DATA;  // what comes in meanwhile is nothing
    wire       order_end = (command == ERASE) ? index == ADDRESS : index == ((command == IDENTIFY) ? IDENTITY_END : DATA_END);
    wire       ends      = (step == ENABLING) || (!opcode && (step == ASKING || order_end));
    wire [7:0] order_opcode = (command == IDENTIFY) ? OPCODE_IDENTIFY : (command == READ) ? OPCODE_READ
                            : (command == ERASE) ? OPCODE_ERASE : OPCODE_PROGRAM;

    assign busy         = (state != IDLE);
    assign write_accept = right;
    assign read_data    = memory[index];

    always @(posedge clk)
        if (rst || write_start) begin
            ours  <= 1'b0;
            whole <= 1'b0;
        end else if (write_valid) begin
            if (first) ours <= take;
            whole <= (write_index == DATA_END);
            case (write_index)
                REPORT_FLASH_WIRE_VERSION[5:0]: version <= (write_data == WIRE_VERSION[7:0]);
                REPORT_FLASH_COMMAND[5:0]: begin
                    asked <= write_data[1:0];
                    known <= (write_data <= FLASH_COMMAND_PROGRAM[7:0]);
                end
                ADDRESS:        aligned <= (write_data[4:0] == 5'd0);
                ADDRESS + 6'd2: reached  <= (write_data < SECTORS) || !asked[1];
                ADDRESS + 6'd3: reached  <= reached && (write_data == 8'd0);
                default: ;
            endcase
        end

    always @(posedge clk) begin
        right <= ours && whole && version && known && aligned && reached && !busy && !running && !begins && !write_start;
        if (begins) command <= asked;
    end

    // Sent in the order 10, 9, 8, 12, 13, ..: the address's highest byte goes first.
    wire [5:0] next_index = (busy && index < DATA) ? ((index == ADDRESS) ? DATA : index - 6'd1) : index + 6'd1;
    wire       stores = (state == STORE) && (step == WORKING) && !in_order && (command != PROGRAM);

    wire [5:0] stored_at = busy ? index : write_index;

    always @(posedge clk)
        if (stores || take) memory[stored_at] <= busy ? shift : write_data;

    always @(posedge clk)
        if (begins) index <= (asked == IDENTIFY) ? DATA : SENT_FIRST;
        else if (busy) begin
            if (state == STORE && step == WORKING && !opcode) index <= next_index;
        end else if (read_start) index <= ADDRESS;
        else if (read_next) index <= next_index;

    always @(posedge clk)
        if (rst) state <= IDLE;
        else case (state)
            IDLE: if (begins) begin
                state  <= LOAD;
                step   <= asked[1] ? ENABLING : WORKING;
                opcode <= 1'b1;
            end
            LOAD: begin
                state <= SHIFT;
                beat  <= 6'd0;
            end
            SHIFT: begin
                beat <= beat + 6'd1;
                if (&beat) state <= STORE;
            end
            STORE: begin
                opcode <= ends;
                state  <= ends ? PAUSE : LOAD;
            end
            PAUSE: begin  // the flash wants to be left alone for 0.1 us between two transactions
                beat <= beat + 6'd1;
                if (beat[3]) begin
                    state <= LOAD;
                    if (step == ENABLING) step <= WORKING;
                    else if (step == WORKING && writes) step <= ASKING;
                    else if (step == WORKING || !shift[0]) state <= IDLE;
                end
            end
            default: state <= IDLE;
        endcase

    always @(posedge clk) begin
        miso <= flash_miso;
        if (state == LOAD)
            shift <= !opcode ? read_data : (step == ENABLING) ? OPCODE_ENABLE : (step == ASKING) ? OPCODE_STATUS : order_opcode;
        else if (state == SHIFT && (&beat[2:0])) shift <= {shift[6:0], miso};
    end

    always @(posedge clk) begin
        flash_cs_n <= (state == IDLE) || (state == PAUSE);
        sck        <= (state == SHIFT) && beat[2];
        flash_mosi <= shift[7];
    end

    always @(negedge clk) flash_sck <= sck;
endmodule

`default_nettype wire
