// The bridge: 28 node lanes in, a USB device out, one 60 MHz clock (the PHY's). A tick pulses SYNC and clocks one record
// out of every node; the framer turns the records of the reading before into a frame, the FIFO holds it until the host
// reads. A USB bus reset or a SET_CONFIGURATION ends a run and empties everything; settings and power-up counters stay.
//
//   tick_generator <-- tick_input <-- tick_in      control_registers <-- HID report 1 --\
//        |   '--------> node_link <--> nodes       run_control, sof_clock               |
//        v                v                                                             |
//   bridge_counters   lane_receiver --> record_store --> framer --> frame_fifo --> whisker_usb <--> UTMI
//        |                '------------> answer_store --\                               |
//        '------------------------------> report_reader --> HID reports 1 to 3, 5 to 7 -/
//                  node_link <-------- service_store <-- HID report 4 ------------------+
//      configuration flash <---------> flash_control <-- HID report 7 -----------------'
//
// link_busy falls when the transfer is over: the next tick may begin, for the framer works from the other bank of the
// record store. transfer_busy falls when the frame is in the FIFO too (about 260 cycles later).

`default_nettype none

module whisker_bridge #(
    parameter       LANES         = 28,
    parameter [7:0] FLASH_SECTORS = 8'd0  // see flash_control; 0: there is no flash, every order is refused
) (
    input  wire             clk,                  // 60 MHz, from the PHY
    input  wire             rst,                  // synchronous, power-up
    output wire             sync,                 // to all nodes: start a reading
    output wire             sck,                  // to all nodes: SPI clock, idles low
    output wire             select_n,             // to all nodes: SPI select
    output wire             mosi,                 // to all nodes: the order
    input  wire [LANES-1:0] miso,                 // one line per node, pulled up: all ones when nobody is there
    input  wire [7:0]       utmi_rx_data,         // UTMI, as its specification names it
    input  wire             utmi_rx_active,       // .
    input  wire             utmi_rx_valid,        // .
    input  wire             utmi_rx_error,        // .
    output wire [7:0]       utmi_tx_data,         // .
    output wire             utmi_tx_valid,        // .
    input  wire             utmi_tx_ready,        // .
    input  wire [1:0]       utmi_line_state,      // .
    input  wire             utmi_vbus_valid,      // .
    input  wire             utmi_session_valid,   // .
    input  wire             utmi_session_end,     // .
    output wire [1:0]       utmi_xcvr_select,     // .
    output wire             utmi_term_select,     // .
    output wire [1:0]       utmi_op_mode,         // .
    input  wire [63:0]      serial_number,        // constant; 0: the text the USB device was generated with
    input  wire             tick_external,        // 1: a tick is a tick_strobe; 0: as the settings say
    input  wire             tick_strobe,          // begin a tick: one cycle; ignored while link_busy or not running
    input  wire             tick_in,              // pin, asynchronous: another bridge's tick_out, a camera, a PPS
    output wire             tick_out,             // to another bridge's tick_in: ahead of SYNC by what that one takes
    output wire             running,              // from start until the last frame is in the FIFO
    output wire             link_busy,            // SYNC and transfer in progress
    output wire             transfer_busy,        // from SYNC until the frame is in the FIFO
    output wire             usb_configured,       // the host has set the configuration
    output reg              frames_lost,          // a frame of this run, or of the one before, was dropped
    output wire             led,                  // a run is in progress
    output wire             flash_cs_n,           // configuration flash
    output wire             flash_sck,            // .
    output wire             flash_mosi,           // .
    input  wire             flash_miso            // .
);
    `include "whisker_protocol.vh"

    localparam FIFO_ADDRESS_BITS = 14;

    // USB
    wire       usb_restart;  // bus reset or SET_CONFIGURATION: one cycle or more
    wire       suspended;    // the host is asleep: ticks are counted, nothing is sampled
    wire       write_start, write_valid, write_done, write_accept, read_start, read_next;
    wire [5:0] write_index;
    wire [1:0] read_packet;
    wire [7:0] write_data, read_id, read_data, stream_data;
    wire       control_accept, service_accept, flash_accept, flash_busy;
    wire [1:0] flash_command;
    wire [7:0] flash_data;
    wire       stream_valid, stream_last, stream_ready;
    wire       sof, read_open;
    wire [10:0] sof_frame;
    wire [7:0]  board;
    wire [15:0] build;

    // Settings and run
    wire             start, stop, run, stopping, final_transfer, take_ticks;
    wire [5:0]       sck_divider, sample_point;
    wire [3:0]       options;
    wire [7:0]       word_gap;
    wire [LANES-1:0] lane_mask;
    wire [31:0]      tick_period;
    wire             halt = rst || usb_restart;

    // Ticks and records
    wire             tick, first_tick, link_active, link_done, capture, bits_valid;
    wire             service_due, service_begin, service_done, in_service, service_bit, service_pending;
    wire [8:0]       service_index;
    wire [7:0]       service_sequence;
    reg  [7:0]       asked_tick;  // of the service order before: its answers carry it
    wire [31:0]      tick_number, tick_edges, tick_early, tick_silent, tick_uneven, tick_shortest;
    wire [15:0]      usb_time, previous_usb_time, sof_cycles;
    wire             tick_level, input_strobe;
    wire             from_pin = |(options & CONTROL_OPTION_TICK_IN[3:0]);
    wire [63:0]      previous_time;
    wire [5:0]       capture_index, bits_index;
    wire [LANES-1:0] bits, absent, crc_wrong, tick_wrong;
    wire [31:0]      reading = tick_number - 32'd1;  // tick whose records this transfer brings
    reg              has_records;                    // there was such a tick
    wire             answer_header, answers_wait;
    wire [7:0]       answers_shown;
    reg              answers_read;                   // the report being read is this one
    reg              pattern;                        // option of the tick under way: a record is of one source
    wire [7:0]       answer_data;

    // Frames
    wire        frame_start = link_done && has_records;
    wire        framer_busy, frame_done, record_ends, frame_dropped;
    wire [5:0]  record_code;
    wire [4:0]  read_lane;
    wire [2:0]  read_byte;
    wire [7:0]  record_data, frame_data;
    wire        frame_valid, frame_first, frame_last, frame_keep, frame_ready;
    wire [31:0] ticks, frames, dropped, sequence_number;
    wire [31:0] records_good, records_absent, records_crc, records_tick;

    always @(posedge clk)
        if (tick) has_records <= !first_tick;

    always @(posedge clk)
        if (service_done) asked_tick <= tick_number[7:0];

    always @(posedge clk)
        if (tick) pattern <= |(options & CONTROL_OPTION_PATTERN[3:0]);

    always @(posedge clk)
        if (read_start) answers_read <= (read_id == REPORT_ID_ANSWERS[7:0]);

    always @(posedge clk)
        if (rst || start) frames_lost <= 1'b0;
        else if (frame_dropped) frames_lost <= 1'b1;

    assign link_busy     = tick || link_active;
    assign transfer_busy = link_busy || framer_busy;
    assign led           = running;

    control_registers #(.LANES(LANES)) control (
        .clk(clk), .rst(rst), .halt(usb_restart),
        .write_start(write_start), .write_valid(write_valid), .write_index(write_index), .write_data(write_data),
        .write_done(write_done), .write_accept(control_accept), .stopping(stopping),
        .start(start), .stop(stop), .run(run), .sck_divider(sck_divider), .word_gap(word_gap),
        .sample_point(sample_point), .options(options), .lane_mask(lane_mask), .tick_period(tick_period));

    assign write_accept = control_accept || service_accept || flash_accept;

    generate
        if (FLASH_SECTORS == 8'd0) begin : no_flash
            wire unused = flash_miso;
            assign {flash_accept, flash_busy, flash_command, flash_data} = 12'd0;
            assign {flash_cs_n, flash_sck, flash_mosi} = 3'b100;
        end else begin : flash
            flash_control #(.SECTORS(FLASH_SECTORS)) control (
                .clk(clk), .rst(rst), .running(running), .write_start(write_start), .write_valid(write_valid),
                .write_index(write_index), .write_data(write_data), .write_done(write_done), .write_accept(flash_accept),
                .read_start(read_start), .read_next(read_next), .read_data(flash_data), .command(flash_command),
                .busy(flash_busy), .flash_cs_n(flash_cs_n), .flash_sck(flash_sck), .flash_mosi(flash_mosi),
                .flash_miso(flash_miso));
        end
    endgenerate

    service_store service (
        .clk(clk), .rst(halt), .power_up(rst), .write_start(write_start), .write_valid(write_valid), .write_index(write_index),
        .write_data(write_data), .write_done(write_done), .write_accept(service_accept), .sck_divider(sck_divider),
        .word_gap(word_gap), .tick_period(tick_period), .due(service_due), .done(service_done),
        .bit_index(service_index), .bit_value(service_bit), .pending(service_pending),
        .sequence_low(service_sequence));

    run_control run_state (
        .clk(clk), .rst(halt), .start(start), .stop(stop), .tick(tick), .last_done(frame_done && frame_keep),
        .running(running), .stopping(stopping), .finishing(final_transfer), .take_ticks(take_ticks));

    tick_input tick_pin (
        .clk(clk), .tick_in(tick_in), .falling(|(options & CONTROL_OPTION_FALLING[3:0])), .clear(rst || start),
        .enable(take_ticks && from_pin && !tick_external), .link_busy(link_busy), .period(tick_period),
        .strobe(input_strobe), .level(tick_level), .edges(tick_edges), .early(tick_early), .silent(tick_silent),
        .uneven(tick_uneven), .shortest(tick_shortest));

    sof_clock usb_clock (
        .clk(clk), .rst(rst), .sof(sof), .sof_frame(sof_frame), .tick(tick), .usb_time(usb_time),
        .previous(previous_usb_time), .cycles(sof_cycles));

    tick_generator ticker (
        .clk(clk), .rst(halt), .restart(start), .enable(take_ticks), .link_busy(link_busy),
        .external(tick_external || from_pin), .strobe(tick_external ? tick_strobe : input_strobe),
        .period(tick_period), .pause(suspended), .tick_out(tick_out),
        .tick(tick), .first(first_tick), .number(tick_number), .previous_time(previous_time));

    node_link link (
        .clk(clk), .rst(halt), .start(tick), .order_tick(tick_number[7:0]),
        .service(service_due && !answers_wait), .service_bit(service_bit), .service_index(service_index),
        .service_begin(service_begin), .service_done(service_done), .in_service(in_service),
        .sck_divider(sck_divider), .word_gap(word_gap), .sample_point(sample_point),
        .busy(link_active), .done(link_done), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi),
        .capture(capture), .record_index(capture_index));

    lane_receiver #(.LANES(LANES)) receiver (
        .clk(clk), .rst(halt), .clear(tick || service_begin),
        .expected_tick(tick ? reading[7:0] : asked_tick),
        .capture(capture), .capture_index(capture_index), .miso(miso),
        .pattern(pattern),
        .bits(bits), .bits_valid(bits_valid), .bits_index(bits_index),
        .absent(absent), .crc_wrong(crc_wrong), .tick_wrong(tick_wrong));

    record_store #(.LANES(LANES)) store (
        .clk(clk), .rst(halt), .swap(link_done), .write(bits_valid && !in_service), .bit_index(bits_index), .bits(bits),
        .read_lane(read_lane), .read_byte(read_byte), .read_data(record_data));

    answer_store #(.LANES(LANES)) answers (
        .clk(clk), .rst(halt), .write(bits_valid && in_service), .bit_index(bits_index), .bits(bits),
        .done(service_done), .hold(read_open && answers_read), .waiting(answers_wait), .sequence_low(service_sequence),
        .shown(answers_shown), .lane_mask(lane_mask), .absent(absent), .crc_wrong(crc_wrong), .tick_wrong(tick_wrong),
        .read_start(read_start), .read_packet(read_packet), .read_next(read_next), .in_header(answer_header),
        .data(answer_data));

    framer #(.LANES(LANES)) frame_maker (
        .clk(clk), .rst(halt), .start(frame_start), .is_last(final_transfer), .tick(reading),
        .tick_time(previous_time), .usb_time(previous_usb_time), .sequence_number(sequence_number), .dropped(dropped), .lane_mask(lane_mask),
        .absent(absent), .crc_wrong(crc_wrong), .tick_wrong(tick_wrong),
        .busy(framer_busy), .done(frame_done), .record_ends(record_ends), .record_code(record_code),
        .read_lane(read_lane), .read_byte(read_byte), .read_data(record_data),
        .out_data(frame_data), .out_valid(frame_valid), .out_first(frame_first), .out_last(frame_last),
        .out_keep(frame_keep), .out_ready(frame_ready));

    frame_fifo #(.ADDRESS_BITS(FIFO_ADDRESS_BITS), .FRAME_BYTES(FRAME_BYTES)) fifo (
        .clk(clk), .rst(halt), .in_data(frame_data), .in_valid(frame_valid), .in_first(frame_first),
        .in_last(frame_last), .in_keep(frame_keep), .every(|(options & CONTROL_OPTION_EVERY_FRAME[3:0])), .in_ready(frame_ready), .dropped(frame_dropped),
        .out_data(stream_data), .out_valid(stream_valid), .out_last(stream_last), .out_ready(stream_ready));

    bridge_counters counters (
        .clk(clk), .rst(rst), .restart(start), .tick(tick), .frame(frame_start), .drop(frame_dropped),
        .record_ends(record_ends), .record_code(record_code),
        .ticks(ticks), .frames(frames), .dropped(dropped), .sequence_number(sequence_number),
        .records_good(records_good), .records_absent(records_absent), .records_crc(records_crc),
        .records_tick(records_tick));

    report_reader #(.LANES(LANES), .FIFO_BYTES(1 << FIFO_ADDRESS_BITS), .FLASH_SECTORS(FLASH_SECTORS)) reports (
        .clk(clk), .read_start(read_start), .read_id(read_id), .read_next(read_next), .read_data(read_data),
        .running(running), .run(run), .sck_divider(sck_divider), .word_gap(word_gap), .sample_point(sample_point),
        .options(options), .board(board), .build(build), .tick(tick_number), .usb_time(usb_time), .sof_cycles(sof_cycles),
        .tick_level(tick_level), .edges(tick_edges), .early(tick_early), .silent(tick_silent), .uneven(tick_uneven),
        .shortest(tick_shortest), .lane_mask(lane_mask), .tick_period(tick_period), .ticks(ticks), .frames(frames), .dropped(dropped),
        .records_good(records_good), .records_absent(records_absent), .records_crc(records_crc),
        .records_tick(records_tick), .pending(service_pending || answers_wait), .sequence_low(answers_shown),
        .flash_command(flash_command), .flash_busy(flash_busy), .flash_data(flash_data), .in_header(answer_header),
        .answer_data(answer_data));

    whisker_usb usb (
        .clk(clk), .rst(rst),
        .utmi_rx_data(utmi_rx_data), .utmi_rx_active(utmi_rx_active), .utmi_rx_valid(utmi_rx_valid),
        .utmi_rx_error(utmi_rx_error), .utmi_tx_data(utmi_tx_data), .utmi_tx_valid(utmi_tx_valid),
        .utmi_tx_ready(utmi_tx_ready), .utmi_line_state(utmi_line_state), .utmi_vbus_valid(utmi_vbus_valid),
        .utmi_session_valid(utmi_session_valid), .utmi_session_end(utmi_session_end),
        .utmi_xcvr_select(utmi_xcvr_select), .utmi_term_select(utmi_term_select), .utmi_op_mode(utmi_op_mode),
        .stream_data(stream_data), .stream_valid(stream_valid), .stream_last(stream_last),
        .sof(sof), .sof_frame(sof_frame), .configured(usb_configured), .board(board), .build(build), .read_open(read_open),
        .stream_ready(stream_ready), .restart(usb_restart), .suspended(suspended), .serial_number(serial_number),
        .write_start(write_start), .write_valid(write_valid), .write_index(write_index), .write_data(write_data),
        .write_done(write_done), .write_accept(write_accept),
        .read_start(read_start), .read_id(read_id), .read_packet(read_packet), .read_next(read_next),
        .read_data(read_data));
endmodule

`default_nettype wire
