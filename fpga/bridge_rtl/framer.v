// Makes a frame: the header, then a record per lane, as a stream of bytes, one a cycle while the reader is ready. A
// record that was accepted goes out as it came; in place of any other stands an error record, which carries the tick
// that was expected and a code that says why: lane_off, absent, link_crc, link_tick, in this order of precedence. A frame
// always has the wire's 28 records: in a bridge with fewer lanes the missing ones are off.
// Everything the frame needs is read at start, except the records' bytes, which the store keeps for one more transfer.
//
//   tick, time, .. --> header, shifted out ------\
//   record_store <-- lane, byte --> data ---------+--[ or error record ]--> crc8 --> output register --> out
//   verdicts, mask --> code of this lane --------/

`default_nettype none

module framer #(
    parameter LANES = 28
) (
    input  wire             clk,           // 60 MHz
    input  wire             rst,           // synchronous; ends a frame at once
    input  wire             start,         // make a frame: one cycle, only while not busy
    input  wire             is_last,       // it is the last of the run
    input  wire [31:0]      tick,          // number of the frame's tick
    input  wire [63:0]      tick_time,     // cycles from start to this tick
    input  wire [15:0]      usb_time,      // when its SYNC came, by sof_clock
    input  wire [31:0]      sequence_number,  // frames made since power-up
    input  wire [31:0]      dropped,       // frames dropped since start
    input  wire [LANES-1:0] lane_mask,     // lanes in use
    input  wire [LANES-1:0] absent,        // verdicts of lane_receiver
    input  wire [LANES-1:0] crc_wrong,     // .
    input  wire [LANES-1:0] tick_wrong,    // .
    output wire             busy,          // a frame is being made or its last byte waits to be taken
    output wire             done,          // its last byte is taken in this cycle
    output wire             record_ends,   // a record is complete: one cycle, with the code below
    output wire [5:0]       record_code,   // its code of the bridge's, CODE_OK if it was accepted
    output reg  [4:0]       read_lane,     // record_store's address
    output wire [2:0]       read_byte,     // .
    input  wire [7:0]       read_data,     // record_store's byte
    output reg  [7:0]       out_data,      // byte of the frame
    output reg              out_valid,     // out_data is there
    output reg              out_first,     // it is the frame's first
    output reg              out_last,      // it is the frame's last
    output reg              out_keep,      // the frame is the run's last: steady through the frame
    input  wire             out_ready      // the byte is taken in this cycle
);
    `include "whisker_protocol.vh"

    localparam HEADER_BITS = 8 * FRAME_HEADER_BYTES;
    localparam [4:0] HEADER_END = FRAME_HEADER_BYTES[4:0] - 5'd1;  // byte that is the header's CRC
    localparam [2:0] RECORD_END = RECORD_CRC[2:0];                 // byte that is the record's
    localparam [4:0] LAST_LANE = LIMIT_LANES[4:0] - 5'd1;          // of the frame, not of this bridge

    reg                   in_header;  // making the header
    reg                   in_records; // making the records
    reg [4:0]             at_byte;    // of the header or of the record
    reg [HEADER_BITS-1:0] header;     // its next byte lowest
    reg [7:0]             tick_low;   // tick of error records
    reg [LANES-1:0]       off, gone, corrupt, stale;  // what is wrong with the lane being framed (bit 0) and the next

    reg  [HEADER_BITS-1:0] new_header;
    always @* begin
        new_header = {HEADER_BITS{1'b0}};
        new_header[8*FRAME_HEADER_MAGIC +: 16] = LIMIT_FRAME_MAGIC[15:0];
        new_header[8*FRAME_HEADER_WIRE_VERSION +: 8] = WIRE_VERSION[7:0];
        new_header[8*FRAME_HEADER_FLAGS +: 8] = is_last ? FRAME_FLAG_LAST[7:0] : 8'h00;
        new_header[8*FRAME_HEADER_TICK +: 32] = tick;
        new_header[8*FRAME_HEADER_TIME +: 64] = tick_time;
        new_header[8*FRAME_HEADER_SEQUENCE +: 32] = sequence_number;
        new_header[8*FRAME_HEADER_DROPPED +: 32] = dropped;
        new_header[8*FRAME_HEADER_LANE_MASK +: LANES] = lane_mask;
        new_header[8*FRAME_HEADER_LANES +: 8] = LIMIT_LANES[7:0];
        new_header[8*FRAME_HEADER_USB_TIME +: 16] = usb_time;
    end

    wire       make        = (in_header || in_records) && (!out_valid || out_ready);
    wire       header_ends = in_header && (at_byte == HEADER_END);
    wire       at_crc      = header_ends || (in_records && at_byte[2:0] == RECORD_END);
    wire       frame_ends  = in_records && at_crc && (read_lane == LAST_LANE);
    wire       accepted    = (record_code == CODE_OK[5:0]);
    wire [7:0] crc;
    reg  [7:0] error_byte;
    reg  [7:0] next_byte;

    assign read_byte   = at_byte[2:0];
    assign record_ends = make && in_records && at_crc;
    assign record_code = off[0] ? CODE_LANE_OFF[5:0]
                       : gone[0] ? CODE_ABSENT[5:0]
                       : corrupt[0] ? CODE_LINK_CRC[5:0]
                       : stale[0] ? CODE_LINK_TICK[5:0]
                       : CODE_OK[5:0];

    // The code stands in the upper byte of the status, which is its second.
    always @* begin
        error_byte = 8'h00;
        if (read_byte == RECORD_TICK[2:0]) error_byte = tick_low;
        if (read_byte == RECORD_STATUS[2:0] + 3'd1) error_byte = {record_code, 2'b00};
    end

    always @* begin
        if (at_crc) next_byte = crc;
        else if (in_header) next_byte = header[7:0];
        else if (accepted) next_byte = read_data;
        else next_byte = error_byte;
    end

    crc8 running_crc (.clk(clk), .clear(start || (make && at_crc)), .valid(make && !at_crc), .data(next_byte), .crc(crc));

    always @(posedge clk)
        if (start) begin
            header   <= new_header;
            tick_low <= tick[7:0];
            out_keep <= is_last;
        end else if (make && in_header) header <= header >> 8;

    always @(posedge clk)
        if (start) begin
            off     <= ~lane_mask;
            gone    <= absent;
            corrupt <= crc_wrong;
            stale   <= tick_wrong;
        end else if (record_ends) begin
            off     <= ~(~off >> 1);
            gone    <= gone >> 1;
            corrupt <= corrupt >> 1;
            stale   <= stale >> 1;
        end

    always @(posedge clk)
        if (rst) begin
            in_header  <= 1'b0;
            in_records <= 1'b0;
        end else if (start) in_header <= 1'b1;
        else if (make && header_ends) begin
            in_header  <= 1'b0;
            in_records <= 1'b1;
        end else if (make && frame_ends) in_records <= 1'b0;

    always @(posedge clk)
        if (start || (make && at_crc)) at_byte <= 5'd0;
        else if (make) at_byte <= at_byte + 5'd1;

    always @(posedge clk)
        if (start) read_lane <= 5'd0;
        else if (record_ends) read_lane <= read_lane + 5'd1;

    always @(posedge clk)
        if (rst) out_valid <= 1'b0;
        else if (make) begin
            out_valid <= 1'b1;
            out_data  <= next_byte;
            out_first <= in_header && (at_byte == 5'd0);
            out_last  <= frame_ends;
        end else if (out_ready) out_valid <= 1'b0;

    assign busy = in_header || in_records || out_valid;
    assign done = out_valid && out_last && out_ready;
endmodule

`default_nettype wire
