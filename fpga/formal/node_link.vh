// node_link: no transfer lasts for ever. Every busy cycle makes a bounded number smaller: windows left, bits left, stage,
// cycles left in the stage, in this order of weight. And each record, each answer is captured whole: 64 times, bit 0 to
// bit 63. That is all lane_receiver waits for.
//
// Assumed: settings within their limits (control_registers refuses others), start only while not busy, a service bit that
// stays while its index does.

reg f_past = 1'b0;  // there is a cycle before
always @(posedge clk) f_past <= 1'b1;
always @* begin
    if (!f_past) assume (rst);
    if (busy || rst) assume (!start);
    assume (sck_divider >= LIMIT_SCK_DIVIDER_MIN[5:0] && sck_divider <= LIMIT_SCK_DIVIDER_MAX[5:0] && !sck_divider[0]);
    assume (word_gap >= LIMIT_WORD_GAP_MIN[7:0]);
    assume (sample_point >= 6'd1 && sample_point <= sck_divider);
end

wire [8:0]  f_end = in_service ? SERVICE_END : ORDER_END;
wire [9:0]  f_bits = {1'b0, f_end} - {&bit_index, bit_index};
wire        f_windows = to_serve && !in_service;
wire [2:0]  f_stage = (state == SYNC) ? 3'd5 : (state == SETUP) ? 3'd4 : (state == BITS) ? 3'd3
                    : (state == GAP) ? 3'd2 : (state == HOLD) ? 3'd1 : 3'd0;
wire [11:0] f_count = (state == BITS) ? {6'd0, divider - 6'd1 - phase} : wait_left;
wire [25:0] f_rank = {f_windows, f_bits, f_stage, f_count};

always @* if (f_past && state != IDLE) begin
    assert (state <= PAUSE);
    assert (divider >= LIMIT_SCK_DIVIDER_MIN[5:0] && divider <= LIMIT_SCK_DIVIDER_MAX[5:0] && !divider[0]);
    assert (sample_at >= 6'd1 && sample_at <= divider);
    assert (gap >= LIMIT_WORD_GAP_MIN[7:0]);
    assert (wait_left < 12'd2400);
    assert (!in_service || to_serve);
    if (state == SYNC) assert (!in_service);
    if (state == SYNC || state == SETUP) assert (bit_index == 9'h1FF);
    if (state == BITS || state == GAP || state == HOLD || state == PAUSE) assert (bit_index <= f_end);
    if (state == BITS) assert (phase < divider);
    if (state == GAP) assert (bit_index[3:0] == 4'hF && bit_index != f_end);
    if (state == HOLD || state == PAUSE) assert (bit_index == f_end);
    if (state == PAUSE) assert (to_serve && !in_service);
end
always @(posedge clk)
    if (f_past && !$past(rst) && $past(busy) && busy) assert (f_rank < $past(f_rank));

// The captures of a window: the record, or the answer, and no bit beyond.
reg [6:0] f_captures;
always @(posedge clk)
    if (start || service_begin) f_captures <= 7'd0;
    else if (capture) f_captures <= f_captures + 7'd1;
wire f_this = (state == BITS) && (phase < sample_at);  // this bit's capture is still to come
always @* if (f_past && busy) begin
    if (capture) assert (f_captures == {1'b0, record_index});
    if (state == SYNC || state == SETUP) assert (f_captures == 7'd0);
    else if (bit_index <= ORDER_END) assert (f_captures == bit_index[6:0] + {6'd0, !f_this});
    else assert (f_captures == 7'd64);
    if (done || service_done) assert (f_captures == 7'd64);
end

// The clock is high in the first half of a bit and at no other time; select is low from SETUP to HOLD. Pins follow a reset
// a cycle later.
reg f_reset = 1'b1;
always @(posedge clk) f_reset <= rst;
always @* if (f_past && f_reset) assert (state == IDLE);
always @* if (f_past && !f_reset) begin
    assert (sck == (state == BITS && phase < {1'b0, divider[5:1]}));
    assert (select_n == !(state == SETUP || state == BITS || state == GAP || state == HOLD));
    assert (sync == (state == SYNC));
end

// The bit that is sent was chosen a cycle before, and is still the right one.
reg [9:0] f_service;  // a cycle before
always @(posedge clk) f_service <= {service_index, service_bit};
always @* if (f_past) begin
    if (service_index == f_service[9:1]) assume (service_bit == f_service[0]);
    if (bit_begins) assert (bit_to_send == next_bit);
end

always @* if (f_past) cover (capture);
