// Decides when a tick begins, and numbers it. Ticks come every `period` cycles, the first LEAD after the start, or from an external
// strobe; a strobe during a transfer on the link is ignored. Time is 0 at the first tick and
// advances by `period` per tick whatever the source, so a simulation that skips idle cycles keeps the device's time.
// While paused a run's ticks are counted but do not begin: the next frame's tick number and time tell of the gap.
//
// tick_out takes the divider's ticks to another bridge's tick_in, TICK_LEAD cycles before this bridge's own SYNC: as long
// as the other takes from its pin to its SYNC. A tick that a strobe begins is passed on as it begins.
//
//   tick_strobe --\
//                  >--[ source ]--[ enable, not busy ]--> tick, first, number, previous_time
//   divider ------/  '--> tick_out

`default_nettype none

module tick_generator (
    input  wire        clk,            // 60 MHz
    input  wire        rst,            // synchronous
    input  wire        restart,        // a run begins: the next tick is number 0
    input  wire        enable,         // ticks are wanted
    input  wire        link_busy,      // a transfer is in progress
    input  wire        external,       // 1: ticks come from strobe, 0: from the divider
    input  wire        strobe,         // external tick, one cycle
    input  wire [31:0] period,         // cycles from tick to tick
    input  wire        pause,          // count on without ticks
    output reg         tick_out,       // to other bridges and cameras: high for 63 cycles
    output reg         tick,           // a tick begins: one cycle, with the values below
    output reg         first,          // this tick is number 0: no reading was started before it
    output reg  [31:0] number,         // of the latest tick
    output reg  [63:0] previous_time   // cycles from tick 0 to the tick before the latest
);
    `include "whisker_protocol.vh"

    // From tick_out's register to SYNC's lie this module's `tick` and two more cycles.
    localparam [31:0] LEAD = LIMIT_TICK_LEAD - 32'd1;

    reg  [5:0]  out_left;   // cycles that tick_out stays high
    reg  [31:0] wait_left;  // cycles until the divider's next tick
    reg  [63:0] tick_time;  // cycles from tick 0 to the latest tick
    reg         fresh;      // no tick since restart
    wire        due = external ? strobe : (wait_left == 32'd0);
    wire        begins = enable && !link_busy && !restart && due;
    wire        announce = enable && !restart && !pause && (external ? begins : (wait_left == LEAD));

    always @(posedge clk)
        if (!enable || restart) wait_left <= LEAD;
        else if (begins) wait_left <= period - 32'd1;
        else if (wait_left != 32'd0) wait_left <= wait_left - 32'd1;

    always @(posedge clk) begin
        tick_out <= announce || (out_left != 6'd0);
        if (rst) out_left <= 6'd0;
        else if (announce) out_left <= 6'd62;
        else if (out_left != 6'd0) out_left <= out_left - 6'd1;
    end

    always @(posedge clk) begin
        tick <= begins && !pause && !rst;
        if (rst || restart) fresh <= 1'b1;
        else if (begins && !pause) fresh <= 1'b0;
        if (begins && !(pause && fresh)) begin
            first <= fresh;
            number <= fresh ? 32'd0 : number + 32'd1;
            tick_time <= fresh ? 64'd0 : tick_time + {32'd0, period};
            previous_time <= tick_time;
        end
    end
endmodule

`default_nettype wire
