// Pads of Cynthion r1.4 (LFE5U-12F): its AUX port's PHY, which takes its 60 MHz from the FPGA, as the FPGA takes it from
// an oscillator. The other ports are left alone; AUX needs no arrangement with the board's microcontroller,
// which is who writes the configuration flash.

`default_nettype none

module cynthion #(
    parameter LANES = 12
) (
    input  wire             clk_60,       // oscillator
    output wire             ulpi_clk,     // to the PHY
    inout  wire [7:0]       ulpi_data,
    input  wire             ulpi_dir,
    input  wire             ulpi_nxt,
    output wire             ulpi_stp,
    output wire             ulpi_reset_n,
    output wire             sync,
    output wire             sck,
    output wire             select_n,
    output wire             mosi,
    input  wire [LANES-1:0] miso,
    input  wire             tick_in,    // pulled down: another bridge's tick_out, a camera, a PPS
    output wire             tick_out,   // to another bridge's tick_in
    output wire [3:0]       led_n
);
    // USB3343: polarity register, D+ and D- swapped, as the board has them
    localparam [5:0] PHY_POLARITY = 6'h39;
    localparam [7:0] PHY_SWAPPED  = 8'h06;

    wire [7:0] data_in, data_out;
    wire       osc, dir, nxt, ulpi_reset, led, flash_cs_n, flash_sck, flash_mosi;
    wire [3:0] leds;
    wire       unused = &{led, flash_cs_n, flash_sck, flash_mosi};

    assign ulpi_clk     = clk_60;
    assign ulpi_reset_n = !ulpi_reset;
    assign led_n        = ~leds;

    ulpi_pads #(.HOLD_CELLS(0)) pads (
        .clk(clk_60), .ulpi_data(ulpi_data), .ulpi_dir(ulpi_dir), .ulpi_nxt(ulpi_nxt), .data_out(data_out),
        .data_in(data_in), .dir(dir), .nxt(nxt));

    (* keep *) OSCG #(.DIV(128)) oscillator (.OSC(osc));

    board_core #(.LANES(LANES), .VENDOR_REGISTER(PHY_POLARITY), .VENDOR_VALUE(PHY_SWAPPED)) core (
        .clk(clk_60), .osc(osc), .ulpi_data_in(data_in), .ulpi_data_out(data_out), .ulpi_dir(dir), .ulpi_nxt(nxt),
        .ulpi_stp(ulpi_stp), .ulpi_reset(ulpi_reset), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi),
        .miso(miso), .tick_in(tick_in), .tick_out(tick_out), .leds(leds), .led(led), .flash_cs_n(flash_cs_n),
        .flash_sck(flash_sck), .flash_mosi(flash_mosi), .flash_miso(1'b0));
endmodule

`default_nettype wire
