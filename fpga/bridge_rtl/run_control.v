// Start and stop of a run. A stop waits for one more tick, whose transfer brings the records of the last tick; the frame
// made of them is the last. A stop before the first tick ends the run at once, without a frame, for nothing was read.
//
//   idle --start--> running --stop--> stopping --tick--> finishing --frame in the FIFO--> idle
//     ^------------ stop before a tick ---'

`default_nettype none

module run_control (
    input  wire clk,         // 60 MHz
    input  wire rst,         // synchronous; also ends a run, as a USB reset does
    input  wire start,       // begin a run; ignored while one is in progress
    input  wire stop,        // end the run
    input  wire tick,        // a tick begins
    input  wire last_done,   // the run's last frame is complete in the FIFO
    output reg  running,     // from start until the last frame is in the FIFO
    output reg  stopping,    // a stop has been asked for and is not finished
    output reg  finishing,   // the transfer in progress is the run's last
    output wire take_ticks   // a tick may begin
);
    reg ticked;  // a tick has begun since start
    assign take_ticks = running && !finishing && (ticked || tick || !stopping);

    always @(posedge clk)
        if (rst || last_done || (stopping && !ticked && !tick)) begin
            running   <= 1'b0;
            stopping  <= 1'b0;
            finishing <= 1'b0;
            ticked    <= 1'b0;
        end else begin
            if (start) running <= 1'b1;
            if (stop && running) stopping <= 1'b1;
            if (tick) ticked <= 1'b1;
            if (tick && stopping && ticked) finishing <= 1'b1;
        end
endmodule

`default_nettype wire
