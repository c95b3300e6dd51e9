// Bench top: the node link with its receiver and record store, wired as in whisker_bridge.

`default_nettype none

module link_bench #(
    parameter LANES = 28
) (
    input  wire             clk,
    input  wire             rst,
    input  wire             start,
    input  wire [7:0]       order_tick,
    input  wire [7:0]       expected_tick,
    input  wire [5:0]       sck_divider,
    input  wire [7:0]       word_gap,
    input  wire [5:0]       sample_point,
    input  wire [LANES-1:0] miso,
    input  wire             pattern,
    input  wire [4:0]       read_lane,
    input  wire [2:0]       read_byte,
    input  wire             service,
    input  wire             service_bit,
    output wire [8:0]       service_index,
    output wire             service_begin,
    output wire             service_done,
    output wire             in_service,
    output wire             busy,
    output wire             done,
    output wire             sync,
    output wire             sck,
    output wire             select_n,
    output wire             mosi,
    output wire [LANES-1:0] absent,
    output wire [LANES-1:0] crc_wrong,
    output wire [LANES-1:0] tick_wrong,
    output wire [7:0]       read_data
);
    wire             capture, bits_valid;
    wire [5:0]       bit_index, bits_index;
    wire [LANES-1:0] bits;

    node_link link (
        .clk(clk), .rst(rst), .start(start), .order_tick(order_tick),
        .service(service), .service_bit(service_bit), .service_index(service_index), .service_begin(service_begin),
        .service_done(service_done), .in_service(in_service),
        .sck_divider(sck_divider), .word_gap(word_gap), .sample_point(sample_point), .busy(busy), .done(done),
        .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi), .capture(capture), .record_index(bit_index));

    lane_receiver #(.LANES(LANES)) receiver (
        .clk(clk), .rst(rst), .clear(start), .expected_tick(expected_tick), .capture(capture),
        .capture_index(bit_index), .miso(miso), .pattern(pattern), .bits(bits), .bits_valid(bits_valid), .bits_index(bits_index),
        .absent(absent), .crc_wrong(crc_wrong), .tick_wrong(tick_wrong));

    record_store #(.LANES(LANES)) store (
        .clk(clk), .rst(rst), .swap(done), .write(bits_valid), .bit_index(bits_index), .bits(bits),
        .read_lane(read_lane), .read_byte(read_byte), .read_data(read_data));
endmodule

`default_nettype wire
