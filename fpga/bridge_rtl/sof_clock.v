// The host's time, as its start-of-frame packets tell it: one every 125 us (a microframe; 1 ms at full speed), eight with the
// same frame number. Taken down at each tick, so that the host can tell when it came, and which ticks of two bridges on
// one bus came together.
//
//   sof, frame number --> frame, microframe, cycles since --tick--> of the latest tick, of the one before

`default_nettype none

module sof_clock (
    input  wire        clk,            // 60 MHz
    input  wire        rst,            // synchronous; there was none
    input  wire        sof,            // a start-of-frame packet has come: one cycle, with its number
    input  wire [10:0] sof_frame,      // .
    input  wire        tick,           // a tick begins; SYNC rises in the next cycle
    output reg  [15:0] usb_time,       // of the latest tick, as in a frame's header
    output reg  [15:0] previous,       // of the tick before
    output reg  [15:0] cycles          // from its start-of-frame packet to the latest tick; 65535: as many or more
);
    reg [11:0] frame;                  // bit 11: there was none yet
    reg [2:0]  microframe;
    reg [15:0] since;                  // cycles since the latest; 65535: as many or more, or there was none
    wire       known = !(&since);

    always @(posedge clk)
        if (rst) since <= 16'hFFFF;
        else if (sof) since <= 16'd0;
        else if (known) since <= since + 16'd1;

    always @(posedge clk)
        if (rst) frame <= 12'h800;
        else if (sof) begin
            frame      <= {1'b0, sof_frame};
            microframe <= ({1'b0, sof_frame} == frame) ? microframe + 3'd1 : 3'd0;
        end

    always @(posedge clk)
        if (rst) begin
            usb_time <= 16'd0;
            previous <= 16'd0;
            cycles   <= 16'hFFFF;
        end else if (tick) begin
            usb_time <= known ? {2'b10, frame[10:0], microframe} : 16'd0;
            previous <= usb_time;
            cycles   <= since;
        end
endmodule

`default_nettype wire
