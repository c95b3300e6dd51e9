// The pin tick_in as a source of ticks: another bridge's tick_out, a camera, a PPS. Two flip-flops, then the chosen edge. An
// edge that comes less than 7/8 of a period after the last one taken, or while a transfer goes on, begins no tick: the
// nodes need their time. What the source does is counted, so that the host can name what is wrong with it.
//
//   tick_in --> pin --> settled --[ rising or falling ]--[ early? busy? ]--> strobe
//                                                             '--> edges, early, silent, uneven, shortest

`default_nettype none

module tick_input (
    input  wire        clk,        // 60 MHz
    input  wire        tick_in,    // asynchronous
    input  wire        falling,    // 1: the falling edge counts
    input  wire        clear,      // a run begins: counts begin anew
    input  wire        enable,     // ticks are wanted, and of this source
    input  wire        link_busy,  // a transfer is in progress
    input  wire [31:0] period,     // cycles between two edges that are expected
    output wire        strobe,     // an edge that begins a tick: one cycle, 2 after the one in which the pin was read
    output wire        level,      // of the pin
    output reg  [31:0] edges,      // that began a tick
    output reg  [31:0] early,      // that began none
    output reg  [31:0] silent,     // times that none came for two periods
    output reg  [31:0] uneven,     // edges that began a tick 1/64 of a period beside their time or more
    output reg  [31:0] shortest    // cycles between any two
);
    reg        pin, settled, former;
    reg        first;       // no edge since clear
    reg [32:0] since_taken; // cycles since the last edge taken; stays at its largest value
    reg [31:0] since_any;   // since the last edge, likewise
    reg        too_early, off_time;  // an edge in the next cycle would be
    reg [31:0] early_until, low, high;  // limits of since_taken

    wire edge_now = enable && (settled != former) && (settled != falling);
    wire refused  = link_busy || (too_early && !first);

    assign strobe = edge_now && !refused;
    assign level  = settled;

    always @(posedge clk) begin
        pin     <= tick_in;
        settled <= pin;
        former  <= settled;
    end

    always @(posedge clk) begin
        early_until <= period - (period >> 3);
        low         <= period - (period >> 6);
        high        <= period + (period >> 6);  // a period of 2^32 is 71 s: no source is so slow
        too_early   <= (since_taken < {1'b0, early_until});
        off_time    <= (since_taken < {1'b0, low}) || (since_taken > {1'b0, high});
    end

    // Counted from 2, for too_early and off_time are a cycle behind: they speak of the distance to the next cycle.
    always @(posedge clk)
        if (clear || strobe) since_taken <= 33'd2;
        else if (!(&since_taken)) since_taken <= since_taken + 33'd1;

    always @(posedge clk)
        if (clear || edge_now) since_any <= 32'd1;
        else if (!(&since_any)) since_any <= since_any + 32'd1;

    always @(posedge clk)
        if (clear) begin
            first    <= 1'b1;
            edges    <= 32'd0;
            early    <= 32'd0;
            silent   <= 32'd0;
            uneven   <= 32'd0;
            shortest <= 32'hFFFFFFFF;
        end else begin
            if (edge_now) first <= 1'b0;
            if (strobe) edges <= edges + 32'd1;
            if (edge_now && refused) early <= early + 32'd1;
            if (enable && !strobe && since_taken == {period, 1'b0}) silent <= silent + 32'd1;
            if (strobe && off_time && !first) uneven <= uneven + 32'd1;
            if (edge_now && !first && since_any < shortest) shortest <= since_any;
        end
endmodule

`default_nettype wire
