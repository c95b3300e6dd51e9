// What three cells of the ECP5 do, without the time they take: a pad, its delay line, a look-up table.

`default_nettype none

module BB (
    inout  wire B,
    input  wire I,
    input  wire T,  // 1: let go
    output wire O
);
    assign B = T ? 1'bz : I;
    assign O = B;
endmodule

module DELAYG #(
    parameter DEL_MODE = "USER_DEFINED"
) (
    input  wire A,
    output wire Z
);
    assign Z = A;
endmodule

module LUT4 #(
    parameter [15:0] INIT = 16'h0000
) (
    input  wire A,
    input  wire B,
    input  wire C,
    input  wire D,
    output wire Z
);
    assign Z = INIT[{D, C, B, A}];
endmodule

`default_nettype wire
