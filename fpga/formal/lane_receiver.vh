// lane_receiver: when a record's 64 bits are in, the verdicts on its lane, whichever one cares to choose, are what its
// bytes say: absent if every bit is one, tick_wrong if the tick is not the expected one, crc_wrong if the last byte is not
// the CRC of the others. They stay until the next clear.
//
// Assumed of node_link (its part, proved there): after a clear come captures of bit 0 to bit 63, once each. A clear comes
// neither with a capture nor in the two cycles after one: SYNC lies between.

reg f_past = 1'b0;  // there is a cycle before
always @(posedge clk) f_past <= 1'b1;

(* anyconst *) wire f_lane;
reg       f_live;     // since a clear there was no reset, which ends a transfer
reg [6:0] f_done;     // bits judged since
reg       f_ones;     // each was one
reg [7:0] f_expected;
reg [7:0] f_first;    // the record's first byte
reg [7:0] f_byte;     // its byte under way, first bit highest
reg [7:0] f_sum;      // CRC register of its whole bytes
reg [7:0] f_before;   // the same before the last byte

wire [6:0] f_reached = f_done + {6'd0, bits_valid};
wire [6:0] f_captured = f_reached + {6'd0, captured};
wire       f_bit = bits[f_lane];
wire [7:0] f_byte_now = f_byte | {f_bit, 7'd0} >> f_done[2:0];

always @* begin
    if (!f_past) assume (clear && !capture && !captured && !bits_valid);
    if (clear) assume (!capture && !captured && !bits_valid && !rst);
    if (f_live && capture) assume (capture_index == f_captured[5:0] && !f_captured[6]);
end

always @(posedge clk)
    if (clear) begin
        {f_live, f_done, f_ones} <= {1'b1, 7'd0, 1'b1};
        {f_expected, f_first, f_byte, f_sum} <= {expected_tick, 8'd0, 8'd0, CRC8_INIT[7:0]};
    end else begin
        if (rst) f_live <= 1'b0;
        if (bits_valid) begin
            f_done <= f_done + 7'd1;
            f_ones <= f_ones && f_bit;
            if (f_done < 7'd8) f_first <= f_byte_now;
            f_byte <= (&f_done[2:0] && f_done != 7'd63) ? 8'd0 : f_byte_now;
            if (&f_done[2:0]) {f_before, f_sum} <= {f_sum, crc8_byte(f_sum, f_byte_now)};
        end
    end

// What a capture saw, or the pattern in its place, is the bit that is judged two cycles later.
always @(posedge clk) if (f_past) begin
    assert (captured == $past(capture && !rst) && bits_valid == $past(captured && !rst));
    if (captured) assert (sampled[f_lane] == $past(miso[f_lane]) && sampled_index == $past(capture_index));
    if (bits_valid) assert (f_bit == ($past(pattern) ? $past(own[f_lane]) : $past(sampled[f_lane])));
end

// The verdicts on a whole record.
always @* if (f_past && f_live && f_done == 7'd64) begin
    assert (absent[f_lane] == f_ones);
    assert (tick_wrong[f_lane] == (f_first != f_expected));
    assert (crc_wrong[f_lane] == (f_byte != (f_before ^ CRC8_XOR_OUT[7:0])));
end

// What the induction needs: where they stand before its end.
function automatic [7:0] f_bits(input [7:0] state, input [7:0] next, input [2:0] count);
    integer i;
    begin
        f_bits = state;
        for (i = 0; i < 8; i = i + 1)
            if (i < count) f_bits = {f_bits[6:0], 1'b0} ^ (f_bits[7] ^ next[7 - i] ? CRC8_POLYNOMIAL[7:0] : 8'h00);
    end
endfunction
wire [7:0] f_crc = {crc[7][f_lane], crc[6][f_lane], crc[5][f_lane], crc[4][f_lane],
                    crc[3][f_lane], crc[2][f_lane], crc[1][f_lane], crc[0][f_lane]};
wire [7:0] f_seen = ~(8'hFF >> f_done);
always @* if (f_past && f_live) begin
    assert (f_captured <= 7'd64);
    if (bits_valid) assert (bits_index == f_done[5:0]);
    if (captured) assert (sampled_index == f_reached[5:0]);
    assert (absent[f_lane] == f_ones);
    assert (tick_wrong[f_lane] == |((f_first ^ f_expected) & f_seen));
    if (f_done < 7'd8) assert (tick == f_expected << f_done && f_first == f_byte);
    assert (f_crc == f_bits(f_sum, f_byte, f_done[2:0]));
    if (f_done == 7'd64) assert (f_sum == crc8_byte(f_before, f_byte));
    else assert (!(f_byte << f_done[2:0]));
end

always @* if (f_past) cover (f_live && f_done == 7'd64);
