// What a board's LEDs tell, in the clock of the FPGA's own oscillator, so that they go on when the PHY's clock stops.
//
//   leds[0] the PHY is set up     leds[2] a run is in progress
//   leds[1] a host configured us  leds[3] error: the PHY's clock is lost, or a frame of this run was dropped
//
// A board with one LED shows `one`: blinking fast for an error, lit in a run, blinking slowly when configured, a short flash
// when the PHY is set up, dark else.

`default_nettype none

module status_leds #(
    parameter BITS = 21  // of the counter: a slow blink takes 0.9 s at 2.4 MHz
) (
    input  wire       osc,
    input  wire       clock_lost,  // in the oscillator's clock
    input  wire       ready,       // in any
    input  wire       configured,  // .
    input  wire       running,     // .
    input  wire       trouble,     // .
    output reg  [3:0] leds,
    output reg        one
);
    reg [3:0]      pins, seen;
    reg [BITS-1:0] count;
    wire           flash = &count[BITS-1:BITS-4];

    initial {pins, seen, leds, one} = 13'd0;
    initial count = 0;

    always @(posedge osc) begin
        count <= count + 1'b1;
        pins  <= {trouble, running, configured, ready};
        seen  <= pins;
        leds  <= clock_lost ? 4'b1000 : seen;
        one   <= leds[3] ? count[BITS-4] : leds[2] ? 1'b1 : leds[1] ? count[BITS-1] : leds[0] && flash;
    end
endmodule

`default_nettype wire
