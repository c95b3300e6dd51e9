// The service order that waits for its tick: HID report `service`, gathered byte by byte and accepted whole. While one is
// pending, or while the settings leave no room for a second window in a tick, another is refused; an order accepted
// before such a change of settings waits until it is undone.
//
//   write bytes --> memory --[ length, wire version, room? ]--accept--> pending --tick--> second window --done--> idle
//                     '--- bit by bit to node_link

`default_nettype none

module service_store (
    input  wire        clk,           // 60 MHz
    input  wire        rst,           // synchronous; forgets a pending order
    input  wire        power_up,      // synchronous; begins the sequence
    input  wire        write_start,   // a report is to come: forget what was gathered
    input  wire        write_valid,   // write_data is a byte of a report
    input  wire [5:0]  write_index,   // its place
    input  wire [7:0]  write_data,    // the byte
    input  wire        write_done,    // the report is complete: accept it or refuse it in this cycle
    output wire        write_accept,  // it is acceptable
    input  wire [5:0]  sck_divider,   // settings
    input  wire [7:0]  word_gap,      // .
    input  wire [31:0] tick_period,   // .
    output wire        due,           // an order waits and a window fits: a tick that begins now carries it
    input  wire        done,          // the window is over
    input  wire [8:0]  bit_index,     // bit of the window from the command on: 8 is the command's first
    output wire        bit_value,     // that bit, in the same cycle; anything in the place of tick and CRCs
    output reg         pending,       // an order waits or is under way
    output reg  [7:0]  sequence_low   // windows since power-up, low bits
);
    `include "whisker_protocol.vh"

    // In the window the CRC of its head follows the arguments; the report has no such byte.
    localparam [5:0] HEAD_END = SERVICE_HEAD_CRC[5:0];

    reg [7:0] memory [0:63];
    reg       ours;     // the bytes that come are a service report's, and none is pending
    reg       version;  // with the right wire version
    reg [6:0] length;

    wire room = (sck_divider <= LIMIT_SCK_DIVIDER_DEFAULT[5:0]) && (word_gap <= LIMIT_WORD_GAP_DEFAULT[7:0])
             && (tick_period >= LIMIT_SERVICE_TICK_MIN);
    reg  had_room;  // a cycle ago: the report takes longer, and the answer to it is the longest way there is
    wire first = (write_index == 6'd0);
    wire take  = write_valid && (first ? write_data == REPORT_ID_SERVICE[7:0] && !pending : ours);

    assign write_accept = ours && version && (length == REPORT_SERVICE_BYTES[6:0]) && had_room && !pending;
    assign due          = pending && room;

    always @(posedge clk) had_room <= room;

    always @(posedge clk)
        if (take) memory[write_index] <= write_data;

    always @(posedge clk)
        if (rst || write_start) begin
            ours    <= 1'b0;
            version <= 1'b0;
            length  <= 7'd0;
        end else if (write_valid) begin
            if (first) ours <= take;
            if (write_index == REPORT_SERVICE_WIRE_VERSION[5:0]) version <= (write_data == WIRE_VERSION[7:0]);
            length <= {1'b0, write_index} + 7'd1;
        end

    always @(posedge clk)
        if (rst) pending <= 1'b0;
        else if (write_done && write_accept) pending <= 1'b1;
        else if (done) pending <= 1'b0;

    always @(posedge clk)
        if (power_up) sequence_low <= 8'd0;
        else if (done) sequence_low <= sequence_low + 8'd1;

    wire [5:0] window_byte = bit_index[8:3];
    wire [5:0] at = (window_byte < HEAD_END) ? window_byte + 6'd1 : window_byte;
    wire [7:0] data = memory[at];
    assign bit_value = data[~bit_index[2:0]];
endmodule

`default_nettype wire
