// What the cells of an ECP5 do that the boards' tops use, and those of a Gowin GW2A behind them, without the time they take. Oscillators and PLLs run as the bench says.

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

module TRELLIS_FF #(
    parameter         GSR    = "ENABLED",
    parameter [127:0] CEMUX  = "1",
    parameter         CLKMUX = "CLK",
    parameter         LSRMUX = "LSR",
    parameter         SRMODE = "LSR_OVER_CE",
    parameter         REGSET = "RESET"
) (
    input  wire CLK,
    input  wire LSR,
    input  wire CE,
    input  wire DI,
    output reg  Q
);
    wire enabled = CEMUX == "CE" ? CE : CEMUX == "INV" ? !CE : 1'b1;
    wire clock   = CLKMUX == "INV" ? !CLK : CLK;

    initial Q = REGSET == "SET";
    initial if (SRMODE == "ASYNC") $stop;  // nothing here has such a reset
    always @(posedge clock)
        if (LSR) Q <= REGSET == "SET";
        else if (enabled) Q <= DI;
endmodule

// The configuration flash's clock pin, which no port of a top is.
module USRMCLK (
    input wire USRMCLKI,
    input wire USRMCLKTS  // 1: let go
);
endmodule

module OSCG #(
    parameter DIV = 128
) (
    output reg OSC /*verilator public_flat_rw*/  // driven by the bench
);
    initial OSC = 1'b0;
endmodule

module EHXPLLL #(
    parameter CLKI_DIV     = 1,
    parameter CLKFB_DIV    = 1,
    parameter CLKOP_DIV    = 8,
    parameter CLKOS_DIV    = 8,
    parameter CLKOP_CPHASE = 0,
    parameter CLKOS_CPHASE = 0,
    parameter CLKOP_ENABLE = "ENABLED",
    parameter CLKOS_ENABLE = "DISABLED",
    parameter FEEDBK_PATH  = "CLKOP"
) (
    input  wire CLKI,
    input  wire CLKFB,
    input  wire RST,
    input  wire STDBY,
    input  wire PHASESEL0,
    input  wire PHASESEL1,
    input  wire PHASEDIR,
    input  wire PHASESTEP,
    input  wire PHASELOADREG,
    input  wire PLLWAKESYNC,
    input  wire ENCLKOP,
    input  wire ENCLKOS,
    output reg  CLKOP /*verilator public_flat_rw*/,  // driven by the bench
    output reg  CLKOS /*verilator public_flat_rw*/,  // .
    output wire LOCK
);
    assign LOCK = 1'b1;
    initial {CLKOP, CLKOS} = 2'b00;
endmodule

module IOBUF (
    output wire O,
    inout  wire IO,
    input  wire I,
    input  wire OEN  // 1: let go
);
    assign IO = OEN ? 1'bz : I;
    assign O  = IO;
endmodule

module LUT2 #(
    parameter [3:0] INIT = 4'h0
) (
    input  wire I0,
    input  wire I1,
    output wire F
);
    assign F = INIT[{I1, I0}];
endmodule

module DFFS (
    output reg  Q,
    input  wire D,
    input  wire CLK,
    input  wire SET
);
    initial Q = 1'b1;
    always @(posedge CLK) Q <= D || SET;
endmodule

module OSC #(
    parameter FREQ_DIV = 100,
    parameter DEVICE   = "GW2A-18"
) (
    output wire OSCOUT
);
    reg OSC /*verilator public_flat_rw*/;  // driven by the bench

    assign OSCOUT = OSC;
    initial OSC = 1'b0;
endmodule

`default_nettype wire
