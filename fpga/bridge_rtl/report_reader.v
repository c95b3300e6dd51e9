// Answers the host's reads: HID reports control, counters, identity, answers, timing and flash. The whole report is taken at once
// when a read begins, so that a counter cannot change between two of its bytes, and is then shifted out; behind the header of
// answers come the bytes of answer_store. Those of flash_control join the header of flash as it is shifted out.
//
//   settings, counters, constants --[ by id ]--start--> report --next--> data, data, ..
//                                     flash_control ------^              ^
//                                     answer_store ----------------------'

`default_nettype none

module report_reader #(
    parameter       LANES         = 28,  // that have a pin
    parameter       FIFO_BYTES    = 16384,
    parameter [7:0] FLASH_SECTORS = 8'd0  // see flash_control
) (
    input  wire             clk,             // 60 MHz
    input  wire             read_start,      // a read begins: data is the report's first byte from the next cycle on
    input  wire [7:0]       read_id,         // of this report
    input  wire             read_next,       // data is taken: show the next byte
    output wire [7:0]       read_data,       // byte of the report
    input  wire             running,         // a run is in progress, its end included
    input  wire             run,             // settings, as written
    input  wire [5:0]       sck_divider,     // .
    input  wire [7:0]       word_gap,        // .
    input  wire [5:0]       sample_point,    // .
    input  wire [LANES-1:0] lane_mask,       // .
    input  wire [31:0]      tick_period,     // .
    input  wire [3:0]       options,         // .
    input  wire [7:0]       board,           // identity, from the build
    input  wire [15:0]      build,           // .
    input  wire [31:0]      tick,            // timing
    input  wire [15:0]      usb_time,        // .
    input  wire [15:0]      sof_cycles,      // .
    input  wire             tick_level,      // .
    input  wire [31:0]      edges,           // .
    input  wire [31:0]      early,           // .
    input  wire [31:0]      silent,          // .
    input  wire [31:0]      uneven,          // .
    input  wire [31:0]      shortest,        // .
    input  wire [31:0]      ticks,           // counters
    input  wire [31:0]      frames,          // .
    input  wire [31:0]      dropped,         // .
    input  wire [31:0]      records_good,    // .
    input  wire [31:0]      records_absent,  // .
    input  wire [31:0]      records_crc,     // .
    input  wire [31:0]      records_tick,    // .
    input  wire             pending,         // service order
    input  wire [7:0]       sequence_low,    // .
    input  wire [1:0]       flash_command,   // flash_control
    input  wire             flash_busy,      // .
    input  wire [7:0]       flash_data,      // . byte of the report, from its address on
    input  wire             in_header,       // answer_store: the report's header is being read
    input  wire [7:0]       answer_data      // byte of the report, if not
);
    `include "whisker_protocol.vh"

    localparam REPORT_BITS = 8 * REPORT_COUNTERS_BYTES;  // the longest
    localparam JOIN = 8 * REPORT_FLASH_ADDRESS;          // where the header of flash ends

    reg [REPORT_BITS-1:0] report;
    reg                   answers;  // the report being read is this one
    reg                   flash;    // .

    always @(posedge clk)
        if (read_start) begin
            report <= {REPORT_BITS{1'b0}};
            report[7:0] <= read_id;
            answers <= (read_id == REPORT_ID_ANSWERS[7:0]);
            flash   <= (read_id == REPORT_ID_FLASH[7:0]);
            report[15:8] <= WIRE_VERSION[7:0];  // at the same place in every report
            case (read_id)
                REPORT_ID_CONTROL[7:0]: begin
                    report[8*REPORT_CONTROL_RUN] <= run;
                    report[8*REPORT_CONTROL_SCK_DIVIDER +: 6] <= sck_divider;
                    report[8*REPORT_CONTROL_WORD_GAP +: 8] <= word_gap;
                    report[8*REPORT_CONTROL_SAMPLE_POINT +: 6] <= sample_point;
                    report[8*REPORT_CONTROL_OPTIONS +: 4] <= options;
                    report[8*REPORT_CONTROL_LANE_MASK +: LANES] <= lane_mask;
                    report[8*REPORT_CONTROL_TICK_PERIOD +: 32] <= tick_period;
                end
                REPORT_ID_COUNTERS[7:0]: begin
                    report[8*REPORT_COUNTERS_RUNNING] <= running;
                    report[8*REPORT_COUNTERS_TICKS +: 32] <= ticks;
                    report[8*REPORT_COUNTERS_FRAMES +: 32] <= frames;
                    report[8*REPORT_COUNTERS_DROPPED +: 32] <= dropped;
                    report[8*REPORT_COUNTERS_RECORDS_GOOD +: 32] <= records_good;
                    report[8*REPORT_COUNTERS_RECORDS_ABSENT +: 32] <= records_absent;
                    report[8*REPORT_COUNTERS_RECORDS_CRC +: 32] <= records_crc;
                    report[8*REPORT_COUNTERS_RECORDS_TICK +: 32] <= records_tick;
                end
                REPORT_ID_IDENTITY[7:0]: begin
                    report[8*REPORT_IDENTITY_LANES +: 8] <= LIMIT_LANES[7:0];
                    report[8*REPORT_IDENTITY_GATEWARE +: 8] <= LIMIT_GATEWARE_VERSION[7:0];
                    report[8*REPORT_IDENTITY_CLOCK_HZ +: 32] <= LIMIT_CLOCK_HZ;
                    report[8*REPORT_IDENTITY_FRAME_BYTES +: 16] <= FRAME_BYTES[15:0];
                    report[8*REPORT_IDENTITY_FIFO_BYTES +: 16] <= FIFO_BYTES[15:0];
                    report[8*REPORT_IDENTITY_BOARD +: 8] <= board;
                    report[8*REPORT_IDENTITY_WIRED_LANES +: 8] <= LANES[7:0];
                    report[8*REPORT_IDENTITY_BUILD +: 16] <= build;
                end
                REPORT_ID_ANSWERS[7:0]: begin
                    report[8*REPORT_ANSWERS_PENDING] <= pending;
                    report[8*REPORT_ANSWERS_SEQUENCE +: 8] <= sequence_low;
                end
                REPORT_ID_TIMING[7:0]: begin
                    report[8*REPORT_TIMING_USB_TIME +: 16] <= usb_time;
                    report[8*REPORT_TIMING_TICK +: 32] <= tick;
                    report[8*REPORT_TIMING_SOF_CYCLES +: 16] <= sof_cycles;
                    report[8*REPORT_TIMING_LEVEL] <= tick_level;
                    report[8*REPORT_TIMING_EDGES +: 32] <= edges;
                    report[8*REPORT_TIMING_EARLY +: 32] <= early;
                    report[8*REPORT_TIMING_SILENT +: 32] <= silent;
                    report[8*REPORT_TIMING_UNEVEN +: 32] <= uneven;
                    report[8*REPORT_TIMING_SHORTEST +: 32] <= shortest;
                end
                REPORT_ID_FLASH[7:0]: begin
                    report[8*REPORT_FLASH_COMMAND +: 2] <= flash_command;
                    report[8*REPORT_FLASH_BUSY] <= flash_busy;
                    report[8*REPORT_FLASH_WRITABLE + 16 +: 8] <= FLASH_SECTORS;
                end
                default: ;
            endcase
        end else if (read_next) begin
            report <= report >> 8;
            if (flash) report[JOIN-1 -: 8] <= flash_data;
        end

    assign read_data = (answers && !in_header) ? answer_data : report[7:0];
endmodule

`default_nettype wire
