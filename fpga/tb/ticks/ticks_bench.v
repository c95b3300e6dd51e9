// Bench top: tick_generator, run_control, bridge_counters, tick_input and sof_clock side by side, each with inputs of its own.

`default_nettype none

module ticks_bench (
    input  wire        clk,
    input  wire        rst,
    input  wire        restart,
    input  wire        enable,
    input  wire        link_busy,
    input  wire        external,
    input  wire        strobe,
    input  wire [31:0] period,
    input  wire        pause,
    output wire        tick,
    output wire        tick_out,
    input  wire        tick_in,
    input  wire        falling,
    input  wire        clear,
    input  wire        watch,
    input  wire        busy,
    input  wire [31:0] expected,
    output wire        taken,
    output wire        level,
    output wire [31:0] edges,
    output wire [31:0] early,
    output wire [31:0] silent,
    output wire [31:0] uneven,
    output wire [31:0] shortest,
    input  wire        sof,
    input  wire [10:0] sof_frame,
    input  wire        stamp,
    output wire [15:0] usb_time,
    output wire [15:0] previous_usb_time,
    output wire [15:0] sof_cycles,
    output wire        first,
    output wire [31:0] number,
    output wire [63:0] previous_time,
    input  wire        start,
    input  wire        stop,
    input  wire        run_tick,
    input  wire        last_done,
    output wire        running,
    output wire        stopping,
    output wire        finishing,
    output wire        take_ticks,
    input  wire        new_run,
    input  wire        count_tick,
    input  wire        frame,
    input  wire        drop,
    input  wire        record_ends,
    input  wire [5:0]  record_code,
    output wire [31:0] ticks,
    output wire [31:0] frames,
    output wire [31:0] dropped,
    output wire [31:0] sequence_number,
    output wire [31:0] records_good,
    output wire [31:0] records_absent,
    output wire [31:0] records_crc,
    output wire [31:0] records_tick
);
    tick_generator ticker (
        .clk(clk), .rst(rst), .restart(restart), .enable(enable), .link_busy(link_busy), .external(external),
        .strobe(strobe), .period(period), .pause(pause), .tick_out(tick_out), .tick(tick), .first(first), .number(number),
        .previous_time(previous_time));

    tick_input input_pin (
        .clk(clk), .tick_in(tick_in), .falling(falling), .clear(clear), .enable(watch), .link_busy(busy),
        .period(expected), .strobe(taken), .level(level), .edges(edges), .early(early), .silent(silent),
        .uneven(uneven), .shortest(shortest));

    sof_clock usb_clock (
        .clk(clk), .rst(rst), .sof(sof), .sof_frame(sof_frame), .tick(stamp), .usb_time(usb_time),
        .previous(previous_usb_time), .cycles(sof_cycles));

    run_control run_state (
        .clk(clk), .rst(rst), .start(start), .stop(stop), .tick(run_tick), .last_done(last_done), .running(running),
        .stopping(stopping), .finishing(finishing), .take_ticks(take_ticks));

    bridge_counters counters (
        .clk(clk), .rst(rst), .restart(new_run), .tick(count_tick), .frame(frame), .drop(drop),
        .record_ends(record_ends), .record_code(record_code), .ticks(ticks), .frames(frames), .dropped(dropped),
        .sequence_number(sequence_number), .records_good(records_good), .records_absent(records_absent),
        .records_crc(records_crc), .records_tick(records_tick));
endmodule

`default_nettype wire
