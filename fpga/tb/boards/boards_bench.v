// Bench top: both tops there are, side by side, each with its PHY's end of the data lines. `drives` says which lines the
// FPGA drives.

`default_nettype none

module boards_bench #(
    parameter LANES = 28
) (
    input  wire             clk,
    input  wire [7:0]       usb3300_data_in,
    output wire [7:0]       usb3300_data_out,
    output wire [7:0]       usb3300_drives,
    input  wire             usb3300_dir,
    input  wire             usb3300_nxt,
    output wire             usb3300_stp,
    output wire             usb3300_reset,
    output wire             usb3300_sync,
    output wire             usb3300_sck,
    output wire             usb3300_select_n,
    output wire             usb3300_mosi,
    input  wire [LANES-1:0] usb3300_miso,
    output wire             usb3300_led_n,
    output wire             cynthion_clk,
    input  wire [7:0]       cynthion_data_in,
    output wire [7:0]       cynthion_data_out,
    output wire [7:0]       cynthion_drives,
    input  wire             cynthion_dir,
    input  wire             cynthion_nxt,
    output wire             cynthion_stp,
    output wire             cynthion_reset_n,
    output wire             cynthion_sync,
    output wire             cynthion_sck,
    output wire             cynthion_select_n,
    output wire             cynthion_mosi,
    input  wire [LANES-1:0] cynthion_miso,
    output wire             cynthion_led_n
);
    wire [7:0] usb3300_data, cynthion_data;

    assign usb3300_data      = usb3300_dir ? usb3300_data_in : 8'hzz;
    assign usb3300_data_out  = usb3300_data;
    assign cynthion_data     = cynthion_dir ? cynthion_data_in : 8'hzz;
    assign cynthion_data_out = cynthion_data;

    usb3300_board #(.LANES(LANES)) usb3300 (
        .clk_60(clk), .ulpi_data(usb3300_data), .ulpi_dir(usb3300_dir), .ulpi_nxt(usb3300_nxt), .ulpi_stp(usb3300_stp),
        .ulpi_reset(usb3300_reset), .sync(usb3300_sync), .sck(usb3300_sck), .select_n(usb3300_select_n),
        .mosi(usb3300_mosi), .miso(usb3300_miso), .led_n(usb3300_led_n));

    cynthion #(.LANES(LANES)) cynthion (
        .clk_60(clk), .ulpi_clk(cynthion_clk), .ulpi_data(cynthion_data), .ulpi_dir(cynthion_dir),
        .ulpi_nxt(cynthion_nxt), .ulpi_stp(cynthion_stp), .ulpi_reset_n(cynthion_reset_n), .sync(cynthion_sync),
        .sck(cynthion_sck), .select_n(cynthion_select_n), .mosi(cynthion_mosi), .miso(cynthion_miso),
        .led_n(cynthion_led_n));

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : line
            assign usb3300_drives[i]  = !usb3300.pads.line[i].pad.T;
            assign cynthion_drives[i] = !cynthion.pads.line[i].pad.T;
        end
    endgenerate
endmodule

`default_nettype wire
