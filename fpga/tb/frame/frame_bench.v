// Bench top: the framer with the FIFO behind it, as in whisker_bridge. The records come from one wide input, lane 0
// lowest, first byte lowest, instead of the record store.

`default_nettype none

module frame_bench #(
    parameter LANES = 28,
    parameter ADDRESS_BITS = 14
) (
    input  wire                clk,
    input  wire                rst,
    input  wire                start,
    input  wire                is_last,
    input  wire [31:0]         tick,
    input  wire [63:0]         tick_time,
    input  wire [15:0]         usb_time,
    input  wire [31:0]         sequence_number,
    input  wire [31:0]         dropped_before,
    input  wire [LANES-1:0]    lane_mask,
    input  wire [LANES-1:0]    absent,
    input  wire [LANES-1:0]    crc_wrong,
    input  wire [LANES-1:0]    tick_wrong,
    input  wire [64*LANES-1:0] records,
    input  wire                stall,
    input  wire                every,
    output wire                busy,
    output wire                done,
    output wire                dropped,
    output wire                record_ends,
    output wire [5:0]          record_code,
    output wire [7:0]          out_data,
    output wire                out_valid,
    output wire                out_last,
    input  wire                out_ready
);
    `include "whisker_protocol.vh"

    wire [4:0] read_lane;
    wire [2:0] read_byte;
    wire [7:0] data;
    wire       valid, first, last, keep, ready;

    framer #(.LANES(LANES)) dut_framer (
        .clk(clk), .rst(rst), .start(start), .is_last(is_last), .tick(tick), .tick_time(tick_time),
        .usb_time(usb_time), .sequence_number(sequence_number), .dropped(dropped_before), .lane_mask(lane_mask), .absent(absent),
        .crc_wrong(crc_wrong), .tick_wrong(tick_wrong), .busy(busy), .done(done), .record_ends(record_ends),
        .record_code(record_code), .read_lane(read_lane), .read_byte(read_byte),
        .read_data(records[8 * {24'd0, read_lane, read_byte} +: 8]),
        .out_data(data), .out_valid(valid), .out_first(first), .out_last(last), .out_keep(keep),
        .out_ready(ready && !stall));

    frame_fifo #(.ADDRESS_BITS(ADDRESS_BITS), .FRAME_BYTES(FRAME_BYTES)) dut_fifo (
        .clk(clk), .rst(rst), .in_data(data), .in_valid(valid && !stall), .in_first(first), .in_last(last),
        .in_keep(keep), .every(every), .in_ready(ready), .dropped(dropped),
        .out_data(out_data), .out_valid(out_valid), .out_last(out_last), .out_ready(out_ready));
endmodule

`default_nettype wire
