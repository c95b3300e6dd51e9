// Records of the bridge's own in place of the nodes': good ones, with the expected tick, other angles for each lane and tick,
// and the right CRC. With them the host proves everything from lane_receiver to itself without a node.
//
// All lanes send the record of lane 0, bit by bit, but for the bits that their number changes: a CRC is linear, so the
// change of its byte is a constant of the lane, too.
//
//   expected_tick --> bit of lane 0 --> crc --\
//                          '-------------------+--[ xor constants of lane n ]--> bits[n]

`default_nettype none

module pattern_source #(
    parameter LANES = 28
) (
    input  wire             clk,            // 60 MHz
    input  wire             clear,          // a transfer begins
    input  wire [7:0]       expected_tick,  // read at clear
    input  wire             step,           // the bit is taken
    input  wire [5:0]       index,          // which bit of the record is asked for
    output wire [LANES-1:0] bits            // that bit of every lane, in the same cycle
);
    `include "whisker_protocol.vh"
    `include "crc8.vh"

    localparam [5:0] CRC_BEGINS = {RECORD_CRC[2:0], 3'd0};

    reg  [7:0] tick, crc;
    wire [63:0] first = {tick, ~tick, 8'h80, tick, 8'h40, 16'h0000, 8'h00};  // of lane 0, first byte highest, the CRC left out
    // The CRC register is shifted while it is sent: its next bit is always the highest.
    wire       own = (index >= CRC_BEGINS) ? crc[7] ^ CRC8_XOR_OUT[{2'b00, ~index[2:0]}] : first[~index];

    always @(posedge clk)
        if (clear) begin
            tick <= expected_tick;
            crc  <= CRC8_INIT[7:0];
        end else if (step)
            crc <= {crc[6:0], 1'b0} ^ ((index < CRC_BEGINS && crc[7] ^ own) ? CRC8_POLYNOMIAL[7:0] : 8'h00);

    // What lane n changes in lane 0's record: the high bytes of alpha and beta, and the CRC.
    function [63:0] change(input [7:0] lane);
        change = {16'h0000, lane, 8'h00, lane, 16'h0000,
                  crc8_byte(crc8_byte(crc8_byte(crc8_byte(crc8_byte(8'h00, lane), 8'h00), lane), 8'h00), 8'h00)};
    endfunction

    genvar n;
    generate
        for (n = 0; n < LANES; n = n + 1) begin : lane
            localparam [63:0] CHANGE = change(n[7:0]);
            assign bits[n] = own ^ CHANGE[~index];
        end
    endgenerate
endmodule

`default_nettype wire
