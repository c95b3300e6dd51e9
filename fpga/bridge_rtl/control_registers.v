// The settings, and the one way to change them: HID report `control`. Its bytes are gathered until the host asks whether
// the report is accepted; it is, whole, when its length, id, wire version and every value are right, else nothing
// changes. Start is refused while a stop is not finished. Settings take effect at the next tick. Of the lane mask, lanes
// of the wire that this bridge does not have are accepted and stay out of use: reading the report back says so.
//
//   write bytes --> incoming --[ all in limits? ]--accept--> settings
//                                                     '----> start, stop

`default_nettype none

module control_registers #(
    parameter LANES = 28
) (
    input  wire             clk,           // 60 MHz
    input  wire             rst,           // synchronous: defaults
    input  wire             halt,          // a USB reset has ended the run: run reads 0, the other settings stay
    input  wire             write_start,   // a report is to come: forget what was gathered
    input  wire             write_valid,   // write_data is a byte of the report
    input  wire [5:0]       write_index,   // its place; 0 begins a new report
    input  wire [7:0]       write_data,    // the byte
    input  wire             write_done,    // the report is complete since a cycle at least: accept or refuse it now
    output wire             write_accept,  // it is acceptable; settings change with write_done
    input  wire             stopping,      // a stop is not finished
    output reg              start,         // begin a run: one cycle
    output reg              stop,          // end the run: one cycle
    output reg              run,           // as last written
    output reg  [5:0]       sck_divider,   // cycles of one SCK period
    output reg  [7:0]       word_gap,      // cycles between two words
    output reg  [3:0]       options,       // bits of control_options
    output reg  [5:0]       sample_point,  // cycles from SCK edge to reading MISO
    output reg  [LANES-1:0] lane_mask,     // lanes in use
    output reg  [31:0]      tick_period    // cycles from tick to tick
);
    `include "whisker_protocol.vh"

    localparam RESERVED = 8 * REPORT_CONTROL_OPTIONS + 4;  // bits that must be zero
    localparam RESERVED_BITS = 8 * REPORT_CONTROL_LANE_MASK - RESERVED;

    reg  [8*REPORT_CONTROL_BYTES-1:0] incoming;  // first byte lowest
    reg  [6:0]                        length;    // bytes gathered

    wire [7:0]  new_run     = incoming[8*REPORT_CONTROL_RUN +: 8];
    wire [7:0]  new_divider = incoming[8*REPORT_CONTROL_SCK_DIVIDER +: 8];
    wire [7:0]  new_gap     = incoming[8*REPORT_CONTROL_WORD_GAP +: 8];
    wire [7:0]  new_sample  = incoming[8*REPORT_CONTROL_SAMPLE_POINT +: 8];
    wire [31:0] new_mask    = incoming[8*REPORT_CONTROL_LANE_MASK +: 32];
    wire [31:0] new_period  = incoming[8*REPORT_CONTROL_TICK_PERIOD +: 32];

    wire ours = (length == REPORT_CONTROL_BYTES[6:0])
             && (incoming[8*REPORT_CONTROL_ID +: 8] == REPORT_ID_CONTROL[7:0])
             && (incoming[8*REPORT_CONTROL_WIRE_VERSION +: 8] == WIRE_VERSION[7:0])
             && (incoming[RESERVED +: RESERVED_BITS] == {RESERVED_BITS{1'b0}});
    wire divider_right = (new_divider >= LIMIT_SCK_DIVIDER_MIN[7:0]) && (new_divider <= LIMIT_SCK_DIVIDER_MAX[7:0])
                      && !new_divider[0];
    wire sample_right  = (new_sample != 8'd0) && (new_sample <= new_divider);
    wire mask_right    = (new_mask >> LIMIT_LANES == 32'd0);
    wire period_right  = (new_period >= LIMIT_TICK_PERIOD_MIN);

    reg  in_limits;  // a cycle ago: the limits and the answer to the report together are too long a way for one cycle

    always @(posedge clk)
        in_limits <= ours && (new_run <= 8'd1) && divider_right && (new_gap >= LIMIT_WORD_GAP_MIN[7:0])
                  && sample_right && mask_right && period_right;

    assign write_accept = in_limits && !(new_run[0] && stopping);
    wire apply = write_done && write_accept;

    always @(posedge clk)
        if (rst || write_start) length <= 7'd0;
        else if (write_valid) begin
            length <= {1'b0, write_index} + 7'd1;
            if ({26'd0, write_index} < REPORT_CONTROL_BYTES) incoming[8*write_index[3:0] +: 8] <= write_data;
        end

    always @(posedge clk) begin
        start <= apply && new_run[0] && !run && !rst && !halt;
        stop  <= apply && !new_run[0] && run && !rst && !halt;
        if (rst || halt) run <= 1'b0;
        else if (apply) run <= new_run[0];
    end

    always @(posedge clk)
        if (rst) begin
            sck_divider  <= LIMIT_SCK_DIVIDER_DEFAULT[5:0];
            word_gap     <= LIMIT_WORD_GAP_DEFAULT[7:0];
            sample_point <= LIMIT_SAMPLE_POINT_DEFAULT[5:0];
            options      <= 4'd0;
            lane_mask    <= {LANES{1'b1}};
            tick_period  <= LIMIT_TICK_PERIOD;
        end else if (apply) begin
            sck_divider  <= new_divider[5:0];
            word_gap     <= new_gap;
            sample_point <= new_sample[5:0];
            options      <= incoming[8*REPORT_CONTROL_OPTIONS +: 4];
            lane_mask    <= new_mask[LANES-1:0];
            tick_period  <= new_period;
        end
endmodule

`default_nettype wire
