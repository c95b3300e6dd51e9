// framer: between a start and `done` go FRAME_BYTES bytes, the first and last marked, whatever the reader's pauses; and
// a reader that takes a byte is given another in the next cycle. Each byte is the one that the protocol has in its place.
//
// Assumed: start comes only while not busy. A frame takes 258 cycles of a reader that does not pause, the shortest
// transfer on the link 517; only the last frame of a run may wait for room, and no tick comes before it is done.

`include "crc8.vh"

reg f_past = 1'b0;  // there is a cycle before
always @(posedge clk) f_past <= 1'b1;
always @* if (!f_past) assume (rst);
always @* if (busy) assume (!start);
always @* if (rst) assume (!start);

localparam [8:0] F_FRAME = FRAME_BYTES, F_HEADER = FRAME_HEADER_BYTES;
reg  [8:0] f_taken;  // bytes of this frame the reader has
wire [8:0] f_made = f_taken + {8'd0, out_valid};
always @(posedge clk)
    if (rst || start) f_taken <= 9'd0;
    else if (out_valid && out_ready) f_taken <= f_taken + 9'd1;

always @* if (f_past) begin
    assert (!(in_header && in_records));
    if (in_header) assert (at_byte < F_HEADER && f_made == {4'd0, at_byte} && read_lane == 5'd0);
    if (in_records) assert (at_byte < RECORD_BYTES && read_lane <= LAST_LANE);
    if (in_records) assert (f_made == F_HEADER + {1'b0, read_lane, 3'd0} + {4'd0, at_byte});
    if (!in_header && !in_records && out_valid) assert (f_made == F_FRAME);
    if (out_valid) assert (out_first == (f_taken == 9'd0));
    if (out_valid) assert (out_last == (f_taken == F_FRAME - 9'd1));
    assert (f_taken <= F_FRAME);
    if (!rst) assert (done == (out_valid && out_ready && f_taken == F_FRAME - 9'd1));
end

// Bytes, marks and `keep` wait for a reader that pauses; one that does not pause has a byte in the next cycle.
always @(posedge clk) if (f_past && !$past(rst) && !rst) begin
    if ($past(out_valid && !out_ready)) assert (out_valid && $stable(out_data) && $stable(out_first) && $stable(out_last));
    if ($past(start)) assert (busy);
    if ($past(busy) && !busy) assert ($past(done));
    if ($past(busy && !done && (out_ready || !out_valid))) assert (out_valid);
    if ($past(record_ends)) assert (!$past(in_header));
end

// What start gave. Of the header one byte is kept, whichever one cares to choose.
localparam [4:0] F_OWN = LANES;  // lanes of this bridge; the others are off
wire [HEADER_BITS-1:0] f_header = {8'd0, usb_time, LIMIT_LANES[7:0], {32 - LANES{1'b0}}, lane_mask, dropped, sequence_number,
    tick_time, tick, is_last ? FRAME_FLAG_LAST[7:0] : 8'd0, WIRE_VERSION[7:0], LIMIT_FRAME_MAGIC[15:0]};
(* anyconst *) wire [4:0] f_where;
reg [7:0]       f_what;
reg             f_keep;
reg [7:0]       f_tick;
reg [LANES-1:0] f_mask, f_absent, f_crc_wrong, f_tick_wrong;
always @(posedge clk) if (start) begin
    f_what <= f_header[8*f_where +: 8];
    f_keep <= is_last;
    f_tick <= tick[7:0];
    {f_mask, f_absent, f_crc_wrong, f_tick_wrong} <= {lane_mask, absent, crc_wrong, tick_wrong};
end

// Byte f_made by the protocol, from what start gave, the store, and a CRC of the bytes before.
wire [8:0] f_place = f_made - F_HEADER;
wire [4:0] f_lane = f_place[7:3];
wire [2:0] f_of_record = f_place[2:0];
wire       f_off = f_lane >= F_OWN || !f_mask[f_lane];
wire [5:0] f_code = f_off ? CODE_LANE_OFF[5:0] : f_absent[f_lane] ? CODE_ABSENT[5:0]
                  : f_crc_wrong[f_lane] ? CODE_LINK_CRC[5:0] : f_tick_wrong[f_lane] ? CODE_LINK_TICK[5:0] : CODE_OK[5:0];
wire [63:0] f_error = {8'd0, f_code, 2'b00, 8'd0, 32'd0, f_tick};  // first byte lowest, the CRC left open
wire       f_head = f_made < F_HEADER;
wire       f_ends = f_head ? f_made == F_HEADER - 9'd1 : f_of_record == RECORD_CRC[2:0];
reg  [7:0] f_crc;
wire [7:0] f_byte = f_ends ? f_crc ^ CRC8_XOR_OUT[7:0] : f_head ? f_what
                  : f_code == CODE_OK[5:0] ? read_data : f_error[8*f_of_record +: 8];
always @(posedge clk)
    if (start || (make && f_ends)) f_crc <= CRC8_INIT[7:0];
    else if (make) f_crc <= crc8_byte(f_crc, next_byte);

always @(posedge clk)
    if (f_past && !$past(rst) && $past(make && (!f_head || f_ends || f_made[4:0] == f_where))) assert (out_data == $past(f_byte));
always @* if (f_past) begin
    if (busy) assert (out_keep == f_keep);
    if (make && in_records) assert ({read_lane, read_byte} == f_place[7:0]);
    if (!rst) assert (record_ends == (make && f_ends && !f_head));
    if (record_ends) assert (record_code == f_code);
end

// What the induction needs: what is shifted is what start gave, shifted.
always @* if (f_past && (in_header || in_records)) begin
    assert (tick_low == f_tick && crc == (f_crc ^ CRC8_XOR_OUT[7:0]));
    assert (~off == f_mask >> read_lane && gone == f_absent >> read_lane);
    assert (corrupt == f_crc_wrong >> read_lane && stale == f_tick_wrong >> read_lane);
    if (in_header && at_byte <= f_where) assert (header[8*(f_where - at_byte) +: 8] == f_what);
end

always @* if (f_past) cover (record_ends && record_code == CODE_OK[5:0]);
