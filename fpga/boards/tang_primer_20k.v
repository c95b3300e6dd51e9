// Pads of a Tang Primer 20K on its dock (Gowin GW2A-18): the dock's USB3317 gives the 60 MHz. As in ulpi_pads.v each pad has a
// register and a gate of its own, and lets go in the cycle in which DIR rises. There are no delay lines: no hold time is
// known that they would have to make up for.

`default_nettype none

module tang_primer_20k #(
    parameter LANES = 28
) (
    input  wire             clk_60,       // the PHY's CLKOUT
    inout  wire [7:0]       ulpi_data,
    input  wire             ulpi_dir,
    input  wire             ulpi_nxt,
    output wire             ulpi_stp,
    output wire             ulpi_reset_n, // the Ethernet PHY's too
    output wire             sync,
    output wire             sck,
    output wire             select_n,
    output wire             mosi,
    input  wire [LANES-1:0] miso,
    output wire [3:0]       led_n
);
    wire [7:0] data_in, data_out, dir_before, let_go;
    wire       osc, ulpi_reset, tick_out, led, flash_cs_n, flash_sck, flash_mosi;
    wire [3:0] leds;
    wire       unused = &{1'b0, tick_out, led, flash_cs_n, flash_sck, flash_mosi};

    assign ulpi_reset_n = !ulpi_reset;
    assign led_n        = ~leds;

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : line
            (* keep *) DFFS turn (.CLK(clk_60), .D(ulpi_dir), .SET(1'b0), .Q(dir_before[i]));
            (* keep *) LUT2 #(.INIT(4'hE)) either (.I0(ulpi_dir), .I1(dir_before[i]), .F(let_go[i]));
            IOBUF pad (.IO(ulpi_data[i]), .I(data_out[i]), .OEN(let_go[i]), .O(data_in[i]));
        end
    endgenerate

    // 250 MHz / 104 = 2.4 MHz
    (* keep *) OSC #(.FREQ_DIV(104), .DEVICE("GW2A-18")) oscillator (.OSCOUT(osc));

    board_core #(.LANES(LANES)) core (
        .clk(clk_60), .osc(osc), .ulpi_data_in(data_in), .ulpi_data_out(data_out), .ulpi_dir(ulpi_dir),
        .ulpi_nxt(ulpi_nxt), .ulpi_stp(ulpi_stp), .ulpi_reset(ulpi_reset), .sync(sync), .sck(sck), .select_n(select_n),
        .mosi(mosi), .miso(miso), .tick_in(1'b0), .tick_out(tick_out), .leds(leds), .led(led), .flash_cs_n(flash_cs_n),
        .flash_sck(flash_sck), .flash_mosi(flash_mosi), .flash_miso(1'b0));
endmodule

`default_nettype wire
