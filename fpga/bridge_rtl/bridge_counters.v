// Counts what the host may ask for. Ticks and frames start again with a run; the records' counters and the sequence
// number run from power-up, so that they outlive a run and a USB reset.
//
//   tick, frame, drop, record code --> counters --> report_reader, framer (sequence, dropped)

`default_nettype none

module bridge_counters (
    input  wire        clk,              // 60 MHz
    input  wire        rst,              // synchronous, power-up only
    input  wire        restart,          // a run begins
    input  wire        tick,             // a SYNC pulse begins
    input  wire        frame,            // a frame is begun
    input  wire        drop,             // a frame is dropped
    input  wire        record_ends,      // a record is framed, with the code below
    input  wire [5:0]  record_code,      // of the bridge's codes
    output reg  [31:0] ticks,            // SYNC pulses since start, the one after the stop included
    output reg  [31:0] frames,           // frames made since start, dropped ones included
    output reg  [31:0] dropped,          // frames dropped since start
    output reg  [31:0] sequence_number,  // frames made since power-up, dropped ones included: the next frame's number
    output reg  [31:0] records_good,     // records since power-up, by verdict; lanes out of use are not counted
    output reg  [31:0] records_absent,   // .
    output reg  [31:0] records_crc,      // .
    output reg  [31:0] records_tick      // .
);
    `include "whisker_protocol.vh"

    always @(posedge clk)
        if (rst || restart) begin
            ticks   <= 32'd0;
            frames  <= 32'd0;
            dropped <= 32'd0;
        end else begin
            if (tick) ticks <= ticks + 32'd1;
            if (frame) frames <= frames + 32'd1;
            if (drop) dropped <= dropped + 32'd1;
        end

    always @(posedge clk)
        if (rst) begin
            sequence_number <= 32'd0;
            records_good    <= 32'd0;
            records_absent  <= 32'd0;
            records_crc     <= 32'd0;
            records_tick    <= 32'd0;
        end else begin
            if (frame) sequence_number <= sequence_number + 32'd1;
            if (record_ends) case (record_code)
                CODE_OK[5:0]:        records_good   <= records_good + 32'd1;
                CODE_ABSENT[5:0]:    records_absent <= records_absent + 32'd1;
                CODE_LINK_CRC[5:0]:  records_crc    <= records_crc + 32'd1;
                CODE_LINK_TICK[5:0]: records_tick   <= records_tick + 32'd1;
                default: ;
            endcase
        end
endmodule

`default_nettype wire
