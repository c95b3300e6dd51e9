// A watchdog on the PHY's clock, in the clock of the FPGA's own oscillator (2.4 MHz on an ECP5, which may be 15 % off). A PHY
// whose clock stops stops everything that it clocks, so nothing there can tell. While no edge comes, `lost` is high, and every
// 65 536 cycles the PHY gets a reset of PULSE cycles, which starts a clock that hangs. The bridge begins anew once it runs.
//
//   clk --> / 256 -> | | --> change? --> silent: cycles since --> lost, phy_reset
//                    osc

`default_nettype none

module phy_watch #(
    parameter [15:0] LIMIT = 16'd256,  // cycles of osc without an edge: 107 us
    parameter [15:0] PULSE = 16'd64    // 27 us; data sheets want 1 us
) (
    input  wire osc,
    input  wire clk,
    output reg  lost,
    output reg  phy_reset
);
    localparam [15:0] LATE = ~PULSE;

    reg [7:0]  divider;
    reg [2:0]  seen;
    reg [15:0] silent;  // cycles since an edge came; it begins anew after 27 ms, for a PHY takes some ms to start its clock
    wire       alive = seen[2] != seen[1];

    initial {divider, seen, silent, lost, phy_reset} = {8'd0, 3'd0, 16'd0, 1'b1, 1'b0};

    always @(posedge clk) divider <= divider + 8'd1;

    always @(posedge osc) begin
        seen      <= {seen[1:0], divider[7]};
        silent    <= alive ? 16'd0 : silent + 16'd1;
        lost      <= !alive && (lost || silent == LIMIT);
        phy_reset <= !alive && lost && silent > LATE;
    end
endmodule

`default_nettype wire
