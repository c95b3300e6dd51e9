// The pins between FPGA and PHY whose timing counts. DATA is let go by one signal, one cell away from every pad. What comes
// from the PHY passes the pads' own delay lines, until the clock has reached the flip-flops: the PHY may change its outputs
// 2 ns after the edge, before a pad register without delay (3.3 ns on speed grade 6) has read them.
//
//   data_out, data_oe --> BB --> ulpi_data --> DELAYG --> data_in
//                                ulpi_dir, ulpi_nxt --> DELAYG --> dir, nxt

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

    DELAYG #(.DEL_MODE("SCLK_ZEROHOLD")) dir_late (.A(ulpi_dir), .Z(dir));
    DELAYG #(.DEL_MODE("SCLK_ZEROHOLD")) nxt_late (.A(ulpi_nxt), .Z(nxt));
endmodule

`default_nettype wire
