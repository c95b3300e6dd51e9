// What the cells of an ECP5 do that the boards' tops use, without the time they take. An oscillator runs as the bench says.

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

// As the pads use it: no enable, no reset.
module TRELLIS_FF #(
    parameter GSR    = "ENABLED",
    parameter CEMUX  = "1",
    parameter REGSET = "RESET"
) (
    input  wire CLK,
    input  wire LSR,
    input  wire CE,
    input  wire DI,
    input  wire M,
    output reg  Q
);
    initial Q = REGSET == "SET";
    always @(posedge CLK) Q <= DI;
endmodule

module OSCG #(
    parameter DIV = 128
) (
    output reg OSC /*verilator public_flat_rw*/  // driven by the bench
);
    initial OSC = 1'b0;
endmodule

`default_nettype wire
