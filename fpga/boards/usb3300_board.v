// Pads of a board with a USB3300, which gives the 60 MHz: Colorlight i9 with a USB3300 module, ECPIX-5.

`default_nettype none

module usb3300_board #(
    parameter       LANES         = 28,
    parameter       LEDS          = 1,    // 1 or 4
    parameter       BLINK_BITS    = 21,
    parameter [7:0] FLASH_SECTORS = 8'd0  // see whisker_bridge
) (
    input  wire             clk_60,     // the PHY's CLKOUT
    inout  wire [7:0]       ulpi_data,
    input  wire             ulpi_dir,
    input  wire             ulpi_nxt,
    output wire             ulpi_stp,
    output wire             ulpi_reset, // active high
    output wire             sync,
    output wire             sck,
    output wire             select_n,
    output wire             mosi,
    input  wire [LANES-1:0] miso,
    input  wire             tick_in,    // pulled down: another bridge's tick_out, a camera, a PPS
    output wire             tick_out,   // to another bridge's tick_in
    output wire [LEDS-1:0]  led_n,
    output wire [1:0]       flash_high, // the configuration flash's WP and HOLD, where the board has them on the FPGA
    output wire             flash_cs_n, // . its clock is no pin of ours but USRMCLK
    output wire             flash_mosi,
    input  wire             flash_miso
);
    wire [7:0] data_in, data_out;
    wire       osc, dir, nxt, led, flash_sck;
    wire [3:0] leds;
    wire       unused = LEDS == 1 ? &leds : led;

    assign led_n      = LEDS == 1 ? {LEDS{!led}} : ~leds[LEDS-1:0];
    assign flash_high = 2'b11;

    (* keep *) USRMCLK flash_clock (.USRMCLKI(flash_sck), .USRMCLKTS(FLASH_SECTORS == 8'd0));

    ulpi_pads pads (
        .clk(clk_60), .ulpi_data(ulpi_data), .ulpi_dir(ulpi_dir), .ulpi_nxt(ulpi_nxt), .data_out(data_out),
        .data_in(data_in), .dir(dir), .nxt(nxt));

    (* keep *) OSCG #(.DIV(128)) oscillator (.OSC(osc));

    board_core #(.LANES(LANES), .FLASH_SECTORS(FLASH_SECTORS), .BLINK_BITS(BLINK_BITS)) core (
        .clk(clk_60), .osc(osc), .ulpi_data_in(data_in), .ulpi_data_out(data_out), .ulpi_dir(dir), .ulpi_nxt(nxt),
        .ulpi_stp(ulpi_stp), .ulpi_reset(ulpi_reset), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi),
        .miso(miso), .tick_in(tick_in), .tick_out(tick_out), .leds(leds), .led(led), .flash_cs_n(flash_cs_n),
        .flash_sck(flash_sck), .flash_mosi(flash_mosi), .flash_miso(flash_miso));
endmodule

`default_nettype wire
