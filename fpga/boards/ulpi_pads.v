// The pins between FPGA and PHY whose timing counts. DATA is let go by one signal, one cell away from every pad. DATA comes in
// through the pads' own delay lines, straight to a flip-flop: the PHY may change its outputs 2 ns after the edge, and a pad
// register without delay holds 3.3 ns (speed grade 6). DIR and NXT pass logic on their way, which delays them; a delay line
// would hide them from nextpnr's timing.
//
//   data_out, data_oe --> BB --> ulpi_data --> DELAYG --> data_in
//                                ulpi_dir, ulpi_nxt -----------> dir, nxt

`default_nettype none

module ulpi_pads (
    inout  wire [7:0] ulpi_data,
    input  wire       ulpi_dir,
    input  wire       ulpi_nxt,
    input  wire [7:0] data_out,
    input  wire       data_oe,   // 1: drive all eight
    output wire [7:0] data_in,
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

    assign dir = ulpi_dir;
    assign nxt = ulpi_nxt;
endmodule

`default_nettype wire
