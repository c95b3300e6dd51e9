// Delays what comes from the PHY by the pads' own delay lines, until the clock has reached the flip-flops: the PHY may
// change its outputs 2 ns after the edge, before a pad register without delay (3.3 ns on speed grade 6) has read them.
//
//   pads --> DELAYG, one a bit --> data, dir, nxt

`default_nettype none

module input_delay #(
    parameter WIDTH = 1
) (
    input  wire [WIDTH-1:0] from_pad,
    output wire [WIDTH-1:0] delayed
);
    genvar i;
    generate
        for (i = 0; i < WIDTH; i = i + 1) begin : line
            DELAYG #(.DEL_MODE("SCLK_ZEROHOLD")) pad (.A(from_pad[i]), .Z(delayed[i]));
        end
    endgenerate
endmodule

`default_nettype wire
