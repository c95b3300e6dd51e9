// The pins between FPGA and PHY whose timing counts. DATA is let go by one signal, one cell away from every pad. DATA comes in
// through the pads' own delay lines, to a flip-flop in the same cell: the PHY may change its outputs 2 ns after the edge, and
// such a flip-flop without delay holds 3.3 ns (speed grade 6), with it 0. Set-up and hold are then the data sheet's, wherever
// the rest is placed (report.py), for nextpnr does not time what a delay line feeds. DIR and NXT go to logic, so they pass
// cells of logic instead where they would change too early; DIR itself makes the pads let go.
//
//   data_out, data_oe --> BB --> ulpi_data --> DELAYG --> data_in --> flip-flop of ulpi_shim, in the pad's cell
//                                ulpi_dir, ulpi_nxt --> hold_cells --> dir, nxt
//                                ulpi_dir ---------------------------> dir_pin

`default_nettype none

module ulpi_pads #(
    parameter HOLD_CELLS = 2     // on the way of dir and nxt
) (
    inout  wire [7:0] ulpi_data,
    input  wire       ulpi_dir,
    input  wire       ulpi_nxt,
    input  wire [7:0] data_out,
    input  wire       data_oe,   // 1: drive all eight
    output wire [7:0] data_in,
    output wire       dir_pin,
    output wire       dir,
    output wire       nxt
);
    wire [7:0] from_pad;
    wire       release_all = !data_oe;

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : line
            BB     pad (.B(ulpi_data[i]), .I(data_out[i]), .T(release_all), .O(from_pad[i]));
            DELAYG #(.DEL_MODE("SCLK_ZEROHOLD")) late (.A(from_pad[i]), .Z(data_in[i]));
        end
    endgenerate

    assign dir_pin = ulpi_dir;

    hold_cells #(.COUNT(HOLD_CELLS)) dir_holds (.in(ulpi_dir), .out(dir));
    hold_cells #(.COUNT(HOLD_CELLS)) nxt_holds (.in(ulpi_nxt), .out(nxt));
endmodule

`default_nettype wire
