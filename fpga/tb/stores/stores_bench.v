// Bench top: record_store, answer_store and service_store side by side. The first two get the same bits, as in
// whisker_bridge, and write strobes of their own.

`default_nettype none

module stores_bench #(
    parameter LANES = 28
) (
    input  wire             clk,
    input  wire             rst,
    input  wire [5:0]       bit_index,
    input  wire [LANES-1:0] bits,
    input  wire             write,
    input  wire             swap,
    input  wire [4:0]       read_lane,
    input  wire [2:0]       read_byte,
    output wire [7:0]       read_data,
    input  wire             answer_write,
    input  wire             answer_done,
    input  wire             hold,
    output wire             waiting,
    output wire [7:0]       shown,
    input  wire [LANES-1:0] lane_mask,
    input  wire [LANES-1:0] absent,
    input  wire [LANES-1:0] crc_wrong,
    input  wire [LANES-1:0] tick_wrong,
    input  wire             read_start,
    input  wire [1:0]       read_packet,
    input  wire             read_next,
    output wire             in_header,
    output wire [7:0]       answer_data,
    input  wire             power_up,
    input  wire             write_start,
    input  wire             write_valid,
    input  wire [5:0]       write_index,
    input  wire [7:0]       write_data,
    input  wire             write_done,
    output wire             write_accept,
    input  wire [5:0]       sck_divider,
    input  wire [7:0]       word_gap,
    input  wire [31:0]      tick_period,
    output wire             due,
    input  wire             service_done,
    input  wire [8:0]       service_index,
    output wire             service_bit,
    output wire             pending,
    output wire [7:0]       sequence_low
);
    record_store #(.LANES(LANES)) records (
        .clk(clk), .rst(rst), .swap(swap), .write(write), .bit_index(bit_index), .bits(bits), .read_lane(read_lane),
        .read_byte(read_byte), .read_data(read_data));

    answer_store #(.LANES(LANES)) answers (
        .clk(clk), .rst(rst), .write(answer_write), .bit_index(bit_index), .bits(bits), .done(answer_done),
        .hold(hold), .waiting(waiting), .sequence_low(sequence_low), .shown(shown),
        .lane_mask(lane_mask), .absent(absent), .crc_wrong(crc_wrong), .tick_wrong(tick_wrong),
        .read_start(read_start), .read_packet(read_packet), .read_next(read_next), .in_header(in_header),
        .data(answer_data));

    service_store service (
        .clk(clk), .rst(rst), .power_up(power_up), .write_start(write_start), .write_valid(write_valid),
        .write_index(write_index), .write_data(write_data), .write_done(write_done), .write_accept(write_accept),
        .sck_divider(sck_divider), .word_gap(word_gap), .tick_period(tick_period), .due(due), .done(service_done),
        .bit_index(service_index), .bit_value(service_bit), .pending(pending), .sequence_low(sequence_low));
endmodule

`default_nettype wire
