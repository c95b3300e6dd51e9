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
//
// A tick with a service order has a second window of 30 words, a pause after the first. Its bits come from
// service_store but for the tick and the two CRCs, which are added here.

`default_nettype none

module node_link (
    input  wire       clk,           // 60 MHz
    input  wire       rst,           // synchronous; ends a transfer at once, the pins a cycle later
    input  wire       start,         // begin a tick: one cycle, only while not busy
    input  wire [7:0] order_tick,    // low bits of the tick number, read at start
    input  wire       service,       // a service order waits: a second window follows; read at start
    input  wire       service_bit,   // its bit `service_index`, in the same cycle; read a cycle before it is needed
    output wire [8:0] service_index, // next bit of the second window
    input  wire [5:0] sck_divider,   // cycles of one SCK period, even, 6 to 32; read at start
    input  wire [7:0] word_gap,      // cycles between two words, at least 30; read at start
    input  wire [5:0] sample_point,  // cycles from rising SCK edge to reading MISO, 1 to sck_divider; read at start
    output wire       busy,          // a tick is in progress
    output wire       done,          // last cycle of the first window
    output wire       service_begin, // the second window begins: one cycle
    output wire       service_done,  // last cycle of the second window
    output reg        in_service,    // from service_begin to service_done
    output reg        sync,          // to all nodes: start a reading, publish the one before
    output reg        sck,           // to all nodes
    output reg        select_n,      // to all nodes
    output reg        mosi,          // to all nodes
    output wire       capture,       // read MISO at the end of this cycle
    output wire [5:0] record_index   // bit of the record being transferred, 0 first
);
    `include "whisker_protocol.vh"

    localparam [7:0] SETUP_CYCLES = 8'd9;
    localparam [7:0] HOLD_CYCLES  = 8'd4;
    localparam [11:0] PAUSE_CYCLES = LIMIT_SERVICE_PAUSE[11:0];
    localparam [5:0] CRC_BYTE     = ORDER_CRC[5:0];                      // the order's CRC, also that of the service order
    localparam [5:0] CRC32_BYTE   = SERVICE_CRC32[5:0];                  // first byte of the service order's other one
    localparam [8:0] ORDER_END    = {ORDER_BYTES[5:0], 3'd0} - 9'd1;      // last bits
    localparam [8:0] SERVICE_END  = {SERVICE_BYTES[5:0], 3'd0} - 9'd1;

    localparam [2:0] IDLE = 3'd0, SYNC = 3'd1, SETUP = 3'd2, BITS = 3'd3, GAP = 3'd4, HOLD = 3'd5, PAUSE = 3'd6;

    reg  [2:0]  state;
    reg  [11:0] wait_left;   // cycles left of SYNC, SETUP, GAP, HOLD or PAUSE
    reg  [5:0]  phase;       // cycles since the rising edge of SCK
    reg  [15:0] order;       // order bits not sent yet, most significant first
    reg  [7:0]  crc;         // of the order bits sent
    reg  [31:0] crc32;       // of all bits sent in this window
    reg  [8:0]  bit_index;   // bit being transferred in this window
    reg         bit_to_send; // the next one
    reg         to_serve;    // a second window is to come
    reg  [7:0]  tick;        // as at start

    reg  [5:0]  divider;     // the settings of this transfer
    reg  [7:0]  gap;
    reg  [5:0]  sample_at;

    wire waited    = (wait_left == 12'd0);
    wire bit_ends  = (state == BITS) && (phase == divider - 6'd1);
    wire word_ends = bit_ends && (bit_index[3:0] == 4'hF);
    wire all_sent  = bit_ends && (bit_index == (in_service ? SERVICE_END : ORDER_END));
    wire [8:0] next_index = bit_index + 9'd1;
    wire bit_begins = ((state == SETUP || state == GAP) && waited) || (bit_ends && !word_ends);

    assign busy    = (state != IDLE);
    wire   window_ends = (state == HOLD) && waited;
    assign done        = window_ends && !in_service;
    assign service_done = window_ends && in_service;
    assign service_begin = (state == PAUSE) && waited;
    assign service_index = next_index;
    assign record_index = bit_index[5:0];
    assign capture = (state == BITS) && (phase == sample_at - 6'd1) && (bit_index <= ORDER_END);

    always @(posedge clk)
        if (rst) state <= IDLE;
        else case (state)
            IDLE:    if (start) state <= SYNC;
            SYNC:    if (waited) state <= SETUP;
            SETUP:   if (waited) state <= BITS;
            BITS:    if (all_sent) state <= HOLD; else if (word_ends) state <= GAP;
            GAP:     if (waited) state <= BITS;
            HOLD:    if (waited) state <= (to_serve && !in_service) ? PAUSE : IDLE;
            default: if (waited) state <= SETUP;
        endcase

    always @(posedge clk)
        if (start) begin
            divider   <= sck_divider;
            gap       <= word_gap;
            sample_at <= sample_point;
            to_serve  <= service;
            tick      <= order_tick;
        end

    always @(posedge clk)
        if (rst || start || service_done) in_service <= 1'b0;
        else if (service_begin) in_service <= 1'b1;

    always @(posedge clk)
        if (start) wait_left <= {4'd0, word_gap} - 12'd1;
        else if (word_ends) wait_left <= {4'd0, all_sent ? HOLD_CYCLES : gap} - 12'd1;
        else if (done) wait_left <= PAUSE_CYCLES - 12'd1;
        else if ((state == SYNC && waited) || service_begin) wait_left <= {4'd0, SETUP_CYCLES} - 12'd1;
        else if (!waited) wait_left <= wait_left - 12'd1;

    // The pins' registers lie in their pads: what resets them is the state, for the reset itself would come too late there.
    always @(posedge clk) begin
        if (state == IDLE) begin
            sync     <= start;
            select_n <= 1'b1;
        end else if (state == SYNC && waited) begin
            sync     <= 1'b0;
            select_n <= 1'b0;
        end else if (service_begin) select_n <= 1'b0;
        else if (window_ends) select_n <= 1'b1;
    end

    always @(posedge clk)
        if (bit_begins) phase <= 6'd0;
        else if (state == BITS) phase <= phase + 6'd1;

    always @(posedge clk)
        if (state == IDLE) sck <= 1'b0;
        else if (bit_begins) sck <= 1'b1;
        else if (phase == {1'b0, divider[5:1]} - 6'd1) sck <= 1'b0;

    always @(posedge clk)
        if (start || service_begin) bit_index <= 9'h1FF;
        else if (bit_begins) bit_index <= next_index;

    // A CRC's own bits: from there on the register is sent instead of updated.
    wire       in_crc32    = in_service && (next_index[8:3] >= CRC32_BYTE);
    wire       in_crc      = (next_index[8:3] == CRC_BYTE);
    wire       source_bit  = in_service && (next_index[8:3] != 6'd0) ? service_bit : order[15];
    wire       next_bit    = in_crc32 ? crc32[31] ^ CRC32_XOR_OUT[31]
                           : in_crc ? crc[7] ^ CRC8_XOR_OUT[{2'b00, ~next_index[2:0]}]
                           : source_bit;
    wire       feedback    = !in_crc && (crc[7] ^ bit_to_send);
    wire       feedback32  = !in_crc32 && (crc32[31] ^ bit_to_send);

    // Nothing that it hangs on changes in the cycle before a bit begins, and MOSI's register is far away, in its pad.
    always @(posedge clk)
        bit_to_send <= next_bit;

    always @(posedge clk)
        if (state == IDLE || state == PAUSE) begin
            mosi  <= 1'b0;
            order <= (state == IDLE) ? {order_tick, service ? COMMAND_SERVICE[7:0] : COMMAND_SAMPLE[7:0]} : {tick, 8'h00};
            crc   <= CRC8_INIT[7:0];
            crc32 <= CRC32_INIT;
        end else if (bit_begins) begin
            mosi  <= bit_to_send;
            order <= {order[14:0], 1'b0};
            crc   <= {crc[6:0], 1'b0} ^ (feedback ? CRC8_POLYNOMIAL[7:0] : 8'h00);
            crc32 <= {crc32[30:0], 1'b0} ^ (feedback32 ? CRC32_POLYNOMIAL : 32'd0);
        end
endmodule

`default_nettype wire
