// CRC-8 of a byte stream: takes a byte a cycle and shows the CRC of all bytes since the last clear. The framer closes
// its header and the records it writes itself with it; the bit-serial CRCs of the node link are in node_link and
// lane_receiver.
//
//   data ----> [ crc8_byte ] --> register --(XOR out)--> crc
//   valid, clear ------------------^

`default_nettype none

module crc8 (
    input  wire       clk,    // 60 MHz
    input  wire       clear,  // start of a message; a byte valid in the same cycle is its first
    input  wire       valid,  // data is one byte of the message
    input  wire [7:0] data,   // the byte
    output wire [7:0] crc     // CRC of the bytes taken so far
);
    `include "whisker_protocol.vh"
    `include "crc8.vh"

    reg  [7:0] register;
    wire [7:0] from = clear ? CRC8_INIT[7:0] : register;

    always @(posedge clk)
        if (valid || clear) register <= valid ? crc8_byte(from, data) : from;

    assign crc = register ^ CRC8_XOR_OUT[7:0];
endmodule

`default_nettype wire
