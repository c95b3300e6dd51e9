// frame_fifo: every byte of a frame that is taken comes out once, in order; every frame is stored whole or counted dropped.
//
// Assumed of the source (framer's part, proved there): a frame is FRAME_BYTES bytes, the first and the last marked, kept
// steady while they wait; in_keep is steady through a frame.

reg f_past = 1'b0;  // there is a cycle before
always @(posedge clk) f_past <= 1'b1;
always @* if (!f_past) assume (rst);

// The source.
reg [ADDRESS_BITS:0] f_byte;  // of the frame coming in
reg                  f_keep;  // it is marked
always @(posedge clk)
    if (rst) f_byte <= 0;
    else if (taken) f_byte <= in_last ? 0 : f_byte + 1;
always @(posedge clk) if (in_valid) f_keep <= in_keep;
always @* begin
    if (in_valid) assume (in_first == (f_byte == 0));
    if (in_valid) assume (in_last == (f_byte == FRAME_BYTES - 1));
    if (in_valid && f_byte != 0) assume (in_keep == f_keep);
end
always @(posedge clk)
    if (f_past && !$past(rst) && $past(in_valid) && !$past(in_ready))
        assume (in_valid && in_data == $past(in_data) && in_keep == $past(in_keep) && in_first == $past(in_first));

// Order: read, commit and write follow each other within the depth; whole frames lie between read and commit.
wire [ADDRESS_BITS:0] f_committed = commit_at - read_at;
wire [ADDRESS_BITS:0] f_open = write_at - commit_at;
always @* if (f_past) begin
    assert (f_committed <= DEPTH);
    assert (f_open < FRAME);
    assert (f_committed + f_open <= DEPTH);
    assert (used == f_committed + f_open);
    assert (f_byte < FRAME_BYTES);
    if (f_byte != 0) assert (f_open == (dropping ? 0 : f_byte));
    if (f_byte == 0) assert (f_open == 0);
    if (f_byte != 0 && !dropping) assert (f_committed <= DEPTH - FRAME);
    if (f_byte != 0 && f_keep) assert (!dropping);
end

// Nothing is lost or doubled: any position one cares to choose holds what was written there until it is read, and comes
// out then; the reader steps by one for every byte shown.
(* anyconst *) wire [ADDRESS_BITS:0] f_where;
reg  [8:0]           f_what;
wire                 f_stored = ((f_where - read_at) < used) && (used != 0);
always @(posedge clk)
    if (!rst && taken && !drop && write_at == f_where) f_what <= {in_last && (in_keep || every), in_data};
always @* if (f_past && f_stored) assert (memory[f_where[ADDRESS_BITS-1:0]] == f_what);
always @(posedge clk) if (f_past && !$past(rst)) begin
    if ($past(refill && !empty)) assert (out_valid && read_at == $past(read_at) + ONE);
    if ($past(refill && empty)) assert (!out_valid && read_at == $past(read_at));
    if ($past(!refill)) assert ($stable(out_data) && $stable(out_last) && out_valid && $stable(read_at));
    if ($past(refill && !empty && read_at == f_where)) assert ({out_last, out_data} == $past(f_what));
end

// A frame is dropped exactly when fewer bytes than it has are free at its first byte and it may be dropped; it is counted
// once. If it may not, it waits exactly as long.
wire f_fits = DEPTH - f_committed >= FRAME;
always @* if (f_past && !rst) begin
    assert (dropped == (in_valid && in_first && !f_fits && !in_keep));
    if (in_valid) assert (in_ready == (!in_first || f_fits || !in_keep));
end

always @* if (f_past) cover (out_valid && out_last && out_ready);
