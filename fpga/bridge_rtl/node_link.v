// The bus all nodes share: one tick is a SYNC pulse, then a transfer of four 16-bit words in SPI mode 1 (clock idles
// low, data changes on the rising edge and is read on the falling). The order goes out on MOSI with its CRC, which is
// computed as the bits leave; `capture` tells lane_receiver when to read all MISO lines.
//
//          __________
//   sync  |          |_________________________________________________________
//         ___________                                                  ________
//   sel              |________________________________________________|
//                      setup    _   _       _     gap     _   _     hold
//   sck   _____________________| |_| |_ ..| |___________| |_| |_ .._______________
//         publish               word 0, 16 bits            word 1
//
// SYNC stays high for one word gap: the nodes need to load their first word, as they need to between two words. Then
// 9 cycles of set-up, 64 bits, 3 gaps, 4 cycles of hold: 517 cycles at divider 6 and gap 30. A divider of 6 adds 3 low
// cycles after the last edge, so select is low for at least 7 cycles (6 wanted) after it.

`default_nettype none

module node_link (
    input  wire       clk,           // 60 MHz
    input  wire       rst,           // synchronous; ends a transfer at once
    input  wire       start,         // begin a tick: one cycle, only while not busy
    input  wire [7:0] order_tick,    // low bits of the tick number, read at start
    input  wire [7:0] order_command, // command for the nodes, read at start
    input  wire [5:0] sck_divider,   // cycles of one SCK period, even, 6 to 32; read at start
    input  wire [7:0] word_gap,      // cycles between two words, at least 30; read at start
    input  wire [5:0] sample_point,  // cycles from rising SCK edge to reading MISO, 1 to sck_divider; read at start
    output wire       busy,          // a tick is in progress
    output wire       done,          // its last cycle
    output reg        sync,          // to all nodes: start a reading, publish the one before
    output reg        sck,           // to all nodes
    output reg        select_n,      // to all nodes
    output reg        mosi,          // to all nodes
    output wire       capture,       // read MISO at the end of this cycle
    output reg  [5:0] bit_index      // bit of the record being transferred, 0 first
);
    `include "whisker_protocol.vh"

    localparam [7:0] SETUP_CYCLES = 8'd9;
    localparam [7:0] HOLD_CYCLES  = 8'd4;
    localparam [5:0] CRC_INDEX    = {ORDER_CRC[2:0], 3'b000};  // first bit of the order's CRC

    localparam [2:0] IDLE = 3'd0, SYNC = 3'd1, SETUP = 3'd2, BITS = 3'd3, GAP = 3'd4, HOLD = 3'd5;

    reg  [2:0]  state;
    reg  [7:0]  wait_left;   // cycles left of SYNC, SETUP, GAP or HOLD
    reg  [5:0]  phase;       // cycles since the rising edge of SCK
    reg  [15:0] order;       // order bits not sent yet, most significant first
    reg  [7:0]  crc;         // of the order bits sent

    reg  [5:0]  divider;     // the settings of this transfer
    reg  [7:0]  gap;
    reg  [5:0]  sample_at;

    wire waited    = (wait_left == 8'd0);
    wire bit_ends  = (state == BITS) && (phase == divider - 6'd1);
    wire word_ends = bit_ends && (bit_index[3:0] == 4'hF);
    wire all_sent  = bit_ends && (bit_index == 6'h3F);
    wire [5:0] next_index = bit_index + 6'd1;
    wire bit_begins = ((state == SETUP || state == GAP) && waited) || (bit_ends && !word_ends);

    assign busy    = (state != IDLE);
    assign done    = (state == HOLD) && waited;
    assign capture = (state == BITS) && (phase == sample_at - 6'd1);

    always @(posedge clk)
        if (rst) state <= IDLE;
        else case (state)
            IDLE:    if (start) state <= SYNC;
            SYNC:    if (waited) state <= SETUP;
            SETUP:   if (waited) state <= BITS;
            BITS:    if (all_sent) state <= HOLD; else if (word_ends) state <= GAP;
            GAP:     if (waited) state <= BITS;
            default: if (waited) state <= IDLE;
        endcase

    always @(posedge clk)
        if (start) begin
            divider   <= sck_divider;
            gap       <= word_gap;
            sample_at <= sample_point;
        end

    always @(posedge clk)
        if (start) wait_left <= word_gap - 8'd1;
        else if (word_ends) wait_left <= (all_sent ? HOLD_CYCLES : gap) - 8'd1;
        else if (state == SYNC && waited) wait_left <= SETUP_CYCLES - 8'd1;
        else if (!waited) wait_left <= wait_left - 8'd1;

    always @(posedge clk) begin
        if (rst || state == IDLE) begin
            sync     <= start && !rst;
            select_n <= 1'b1;
        end else if (state == SYNC && waited) begin
            sync     <= 1'b0;
            select_n <= 1'b0;
        end else if (done) select_n <= 1'b1;
    end

    always @(posedge clk)
        if (bit_begins) phase <= 6'd0;
        else if (state == BITS) phase <= phase + 6'd1;

    always @(posedge clk)
        if (rst) sck <= 1'b0;
        else if (bit_begins) sck <= 1'b1;
        else if (phase == {1'b0, divider[5:1]} - 6'd1) sck <= 1'b0;

    always @(posedge clk)
        if (start) bit_index <= 6'h3F;
        else if (bit_begins) bit_index <= next_index;

    // The last byte of the order is its CRC: from there on the register is sent instead of updated.
    wire       sending_crc = (next_index >= CRC_INDEX);
    wire       next_bit    = sending_crc ? crc[7] ^ CRC8_XOR_OUT[{2'b00, ~next_index[2:0]}] : order[15];
    wire       feedback    = !sending_crc && (crc[7] ^ next_bit);
    wire [7:0] crc_next    = {crc[6:0], 1'b0} ^ (feedback ? CRC8_POLYNOMIAL[7:0] : 8'h00);

    always @(posedge clk)
        if (state == IDLE) begin
            mosi  <= 1'b0;
            order <= {order_tick, order_command};
            crc   <= CRC8_INIT[7:0];
        end else if (bit_begins) begin
            mosi  <= next_bit;
            order <= {order[14:0], 1'b0};
            crc   <= crc_next;
        end
endmodule

`default_nettype wire
