// The pins between an ECP5 and its PHY whose timing counts. DATA comes in through the pads' own delay lines, to a flip-flop in
// the same cell: the PHY may change its outputs 2 ns after the edge, and such a flip-flop without delay holds 3.3 ns (speed
// grade 6), with it 0. Set-up and hold are then the data sheet's, wherever the rest is placed (report.py), for nextpnr does not
// time what a delay line feeds. DIR and NXT go to logic, so they pass cells of logic instead where they would change too early.
//
// The pads let go in the cycle in which DIR rises and drive again from the first edge at which it is low: each pad has a
// flip-flop and a gate of its own beside it. A flip-flop in the pad's cell cannot be followed by a gate, and without the gate
// FPGA and PHY would both drive for some ns, since the PHY begins at the next edge. What data_out holds while DIR is high does
// not matter, so DIR takes no part in its choice, which would be the longest way in.
//
//   data_out ----------------------> BB --> ulpi_data --> DELAYG --> data_in --> flip-flop of ulpi_shim, in the pad's cell
//   dir --> flip-flop --> gate --T----'
//   ulpi_dir ---------------'    ulpi_dir, ulpi_nxt --> hold_cells --> dir, nxt

`default_nettype none

module ulpi_pads #(
    parameter HOLD_CELLS = 2     // on the way of dir and nxt
) (
    input  wire       clk,
    inout  wire [7:0] ulpi_data,
    input  wire       ulpi_dir,
    input  wire       ulpi_nxt,
    input  wire [7:0] data_out,
    output wire [7:0] data_in,
    output wire       dir,
    output wire       nxt
);
    wire [7:0] from_pad, dir_before, let_go;

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : line
            (* keep *) TRELLIS_FF #(.GSR("DISABLED"), .CEMUX("1"), .REGSET("SET")) turn (
                .CLK(clk), .LSR(1'b0), .CE(1'b1), .DI(dir), .Q(dir_before[i]));
            (* keep *) LUT4 #(.INIT(16'hEEEE)) either (
                .A(ulpi_dir), .B(dir_before[i]), .C(1'b0), .D(1'b0), .Z(let_go[i]));
            BB     pad (.B(ulpi_data[i]), .I(data_out[i]), .T(let_go[i]), .O(from_pad[i]));
            DELAYG #(.DEL_MODE("SCLK_ZEROHOLD")) late (.A(from_pad[i]), .Z(data_in[i]));
        end
    endgenerate

    hold_cells #(.COUNT(HOLD_CELLS)) dir_holds (.in(ulpi_dir), .out(dir));
    hold_cells #(.COUNT(HOLD_CELLS)) nxt_holds (.in(ulpi_nxt), .out(nxt));
endmodule

`default_nettype wire
