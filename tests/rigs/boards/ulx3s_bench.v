// Bench top: a ULX3S between a USB cable and nodes. The clocks of its PLL are the bench's.

`default_nettype none

module ulx3s_bench (
    input  wire        host_p,
    input  wire        host_n,
    output wire        device_p,
    output wire        device_n,
    output wire [1:0]  device_drives,  // by pad
    output wire        pull_up,
    output wire        sync,
    output wire        sck,
    output wire        select_n,
    output wire        mosi,
    input  wire [27:0] miso,
    output wire [3:0]  leds
);
    wire       d_p, d_n, tick_out, flash_cs_n, flash_mosi;
    wire [1:0] flash_high;

    assign device_drives = {!board.d_p_pad.T, !board.d_n_pad.T};
    assign d_p           = device_drives[1] ? 1'bz : host_p;
    assign d_n           = device_drives[0] ? 1'bz : host_n;
    assign device_p      = d_p;
    assign device_n      = d_n;

    ulx3s #(.LANES(28)) board (
        .clk_25(1'b0), .usb_d_p(d_p), .usb_d_n(d_n), .usb_pull_up(pull_up), .sync(sync), .sck(sck), .select_n(select_n),
        .mosi(mosi), .miso(miso), .tick_in(1'b0), .tick_out(tick_out), .led(leds),
        .flash_cs_n(flash_cs_n), .flash_mosi(flash_mosi), .flash_miso(1'b1), .flash_high(flash_high));
endmodule

`default_nettype wire
