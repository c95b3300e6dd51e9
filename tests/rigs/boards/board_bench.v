// Bench top: a board's top between a PHY and nodes, under names that all boards share. BOARD_CYNTHION or BOARD_TANG
// chooses the board; BOARD_NETLIST: what synthesis makes of a usb3300_board.

`default_nettype none

module board_bench (
    input  wire        clk,         // at the FPGA's 60 MHz pin
    input  wire        dir,
    input  wire        nxt,
    input  wire [7:0]  phy_data,    // while the PHY drives, that is while dir is high
    output wire [7:0]  link_data,
    output wire [7:0]  link_drives, // by pad
    output wire        stp,
    output wire        reset,       // 1: the PHY is in reset
    output wire        sync,
    output wire        sck,
    output wire        select_n,
    output wire        mosi,
    input  wire [27:0] miso,
    output wire [3:0]  leds,        // 1: lit; see status_leds
    output wire        led          // the only one of a board that has one
);
    wire [7:0] data;
    wire       tick_out;

    assign data      = dir ? phy_data : 8'hzz;
    assign link_data = data;

`ifdef BOARD_CYNTHION
    wire       reset_n, phy_clk;
    wire [3:0] led_n;

    assign reset = !reset_n;
    assign leds  = ~led_n;
    assign led   = 1'b0;

    cynthion #(.LANES(28)) board (
        .clk_60(clk), .ulpi_clk(phy_clk), .ulpi_reset_n(reset_n),
`elsif BOARD_TANG
    wire       reset_n;
    wire [3:0] led_n;

    assign reset    = !reset_n;
    assign leds     = ~led_n;
    assign led      = 1'b0;
    assign tick_out = 1'b0;

    tang_primer_20k #(.LANES(28)) board (
        .clk_60(clk), .ulpi_reset_n(reset_n),
`else
    wire led_n, flash_cs_n, flash_mosi;

    assign led = !led_n;
`ifdef BOARD_NETLIST
    assign leds = 4'd0; // with one LED synthesis leaves the others out

    usb3300_board board (
`else
    wire [1:0] flash_high;

    assign leds = board.core.leds;

    usb3300_board #(.LANES(28), .BLINK_BITS(8)) board (
        .flash_high(flash_high),
`endif
        .clk_60(clk), .ulpi_reset(reset), .flash_cs_n(flash_cs_n), .flash_mosi(flash_mosi), .flash_miso(1'b1),
`endif
        .ulpi_data(data), .ulpi_dir(dir), .ulpi_nxt(nxt), .ulpi_stp(stp), .sync(sync), .sck(sck), .select_n(select_n),
`ifndef BOARD_TANG
        .tick_in(1'b0), .tick_out(tick_out),
`endif
        .mosi(mosi), .miso(miso), .led_n(led_n));

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : line
`ifdef BOARD_TANG
            assign link_drives[i] = !board.line[i].pad.OEN;
`elsif BOARD_NETLIST
            assign link_drives[i] = !board.\pads.let_go [i];
`else
            assign link_drives[i] = !board.pads.line[i].pad.T;
`endif
        end
    endgenerate
endmodule

`default_nettype wire
