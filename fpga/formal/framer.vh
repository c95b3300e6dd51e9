// framer: between a start and `done` go FRAME_BYTES bytes, the first and last marked, whatever the reader's pauses; and
// a reader that takes a byte is given another in the next cycle.
//
// Assumed: start comes only while not busy. A frame takes 258 cycles of a reader that does not pause, the shortest
// transfer on the link 517; only the last frame of a run may wait for room, and no tick comes before it is done.

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
    if ($past(busy && !start)) assert ($stable(out_keep));
    if ($past(start)) assert (busy);
    if ($past(busy) && !busy) assert ($past(done));
    if ($past(busy && !done && (out_ready || !out_valid))) assert (out_valid);
    if ($past(record_ends)) assert (!$past(in_header));
end

always @* if (f_past) cover (out_valid && out_last);
