// The nodes' answers of the latest service window, kept until the next one, and read as the body of HID report `answers`:
// alpha, beta and status of every lane. In place of a record that was not accepted stands the bridge's code, as in a
// frame; lanes that this bridge does not have are off. A window that ends while the host reads waits until the read is
// over: a read has several packets, all of one window.
//
//   bits[LANES] --> record_store --> alpha, beta, status --\
//   verdicts ------> next --> kept --> code ---------------+--> data, data, ..

`default_nettype none

module answer_store #(
    parameter LANES = 28
) (
    input  wire             clk,          // 60 MHz
    input  wire             rst,          // synchronous
    input  wire             write,        // bits is to be stored
    input  wire [5:0]       bit_index,    // bit of the record
    input  wire [LANES-1:0] bits,         // that bit of every lane
    input  wire             done,         // the window is over: keep the verdicts, and show these records when hold allows
    input  wire             hold,         // a read is under way
    output reg              waiting,      // a window is over and not shown yet: no other may begin
    input  wire [7:0]       sequence_low, // windows; read in the cycle after done
    output reg  [7:0]       shown,        // the same of what is shown
    input  wire [LANES-1:0] lane_mask,    // lanes in use
    input  wire [LANES-1:0] absent,       // verdicts of lane_receiver
    input  wire [LANES-1:0] crc_wrong,    // .
    input  wire [LANES-1:0] tick_wrong,   // .
    input  wire             read_start,   // a read begins
    input  wire [1:0]       read_packet,  // at byte 64 * read_packet of the report
    input  wire             read_next,    // data is taken: show the next byte
    output wire             in_header,    // the byte to show is of the report's header
    output wire [7:0]       data          // byte of the report's body, if not
);
    `include "whisker_protocol.vh"

    localparam LANE_BYTES = 6;
    localparam [31:0] SECOND = 32'd64 - REPORT_ANSWERS_ANSWER;   // where the later packets begin in the body
    localparam [31:0] THIRD  = 32'd128 - REPORT_ANSWERS_ANSWER;
    localparam [31:0] SECOND_LANE = SECOND / LANE_BYTES, SECOND_BYTE = SECOND % LANE_BYTES + RECORD_ALPHA;
    localparam [31:0] THIRD_LANE = THIRD / LANE_BYTES, THIRD_BYTE = THIRD % LANE_BYTES + RECORD_ALPHA;
    localparam [2:0] FIRST_BYTE = RECORD_ALPHA[2:0], LAST_BYTE = RECORD_CRC[2:0] - 3'd1;

    reg [LANES-1:0] off, gone, corrupt, stale;
    reg [LANES-1:0] next_off, next_gone, next_corrupt, next_stale;
    wire            show = waiting && !hold;
    reg [3:0]       header_left;  // bytes
    reg [4:0]       lane;
    reg [2:0]       at_byte;      // of the record
    wire [7:0]      record_data;

    record_store #(.LANES(LANES)) store (
        .clk(clk), .rst(rst), .swap(show), .write(write), .bit_index(bit_index), .bits(bits),
        .read_lane(lane), .read_byte(at_byte), .read_data(record_data));

    always @(posedge clk)
        if (done) begin
            next_off     <= ~lane_mask;
            next_gone    <= absent;
            next_corrupt <= crc_wrong;
            next_stale   <= tick_wrong;
        end

    // Before the first window nothing is known of any lane.
    always @(posedge clk)
        if (rst) begin
            off     <= {LANES{1'b0}};
            gone    <= {LANES{1'b1}};
            corrupt <= {LANES{1'b0}};
            stale   <= {LANES{1'b0}};
            waiting <= 1'b0;
            shown   <= sequence_low;
        end else begin
            waiting <= done || (waiting && hold);
            if (show) begin
                off     <= next_off;
                gone    <= next_gone;
                corrupt <= next_corrupt;
                stale   <= next_stale;
                shown   <= sequence_low;
            end
        end

    always @(posedge clk)
        if (read_start) begin
            header_left <= (read_packet == 2'd0) ? REPORT_ANSWERS_ANSWER[3:0] : 4'd0;
            lane        <= (read_packet == 2'd0) ? 5'd0 : (read_packet == 2'd1) ? SECOND_LANE[4:0] : THIRD_LANE[4:0];
            at_byte     <= (read_packet == 2'd0) ? FIRST_BYTE
                         : (read_packet == 2'd1) ? SECOND_BYTE[2:0] : THIRD_BYTE[2:0];
        end else if (read_next) begin
            if (in_header) header_left <= header_left - 4'd1;
            else if (at_byte == LAST_BYTE) begin
                at_byte <= FIRST_BYTE;
                lane    <= lane + 5'd1;
            end else at_byte <= at_byte + 3'd1;
        end

    // One bit for every value of `lane`: a lane that this bridge does not have is off.
    wire [31:0] is_off     = {{32 - LANES{1'b1}}, off};
    wire [31:0] is_gone    = {{32 - LANES{1'b0}}, gone};
    wire [31:0] is_corrupt = {{32 - LANES{1'b0}}, corrupt};
    wire [31:0] is_stale   = {{32 - LANES{1'b0}}, stale};

    wire       accepted = !(is_off[lane] || is_gone[lane] || is_corrupt[lane] || is_stale[lane]);
    wire [5:0] code = is_off[lane] ? CODE_LANE_OFF[5:0]
                    : is_gone[lane] ? CODE_ABSENT[5:0]
                    : is_corrupt[lane] ? CODE_LINK_CRC[5:0]
                    : CODE_LINK_TICK[5:0];

    assign in_header = (header_left != 4'd0);
    assign data = accepted ? record_data : (at_byte == LAST_BYTE) ? {code, 2'b00} : 8'h00;
endmodule

`default_nettype wire
