// Reads all lanes at once and judges their records while they arrive. Everything is one bit per lane wide and updated
// once per bit time: the sampled MISO lines, eight slices of the lanes' CRC registers, and whether a lane has sent only
// ones or a wrong tick number. So 28 lanes cost eight vectors and no per-lane logic, and the verdicts are ready with the
// last bit. They stay until the next clear. MISO passes two flip-flops, so that a line that changes while it is read is
// one bit for all that read it. The second takes the pattern instead, if the host wants it.
//
//   miso[LANES] --capture--> sampled --[ or pattern ]
//                                      |
//                                     bits ---+--> (record_store)
//                                             +--> crc slice 7..0 --> crc_wrong[LANES]
//   expected_tick, bit 7..0 ------------------+--> xor -----------> tick_wrong[LANES]
//                                             +--> and -----------> absent[LANES]

`default_nettype none

module lane_receiver #(
    parameter LANES = 28
) (
    input  wire             clk,            // 60 MHz
    input  wire             rst,            // synchronous
    input  wire             clear,          // a transfer begins
    input  wire [7:0]       expected_tick,  // tick number the records must carry, read at clear
    input  wire             capture,        // read MISO at the end of this cycle
    input  wire [5:0]       capture_index,  // bit of the record then on MISO
    input  wire [LANES-1:0] miso,           // one line per lane
    input  wire             pattern,        // 1: records of pattern_source in their place
    output reg  [LANES-1:0] bits,           // the bit last read from each lane
    output reg              bits_valid,     // bits is new: one cycle
    output reg  [5:0]       bits_index,     // bit of the record held in bits
    output reg  [LANES-1:0] absent,         // every bit was one: nobody drives the line
    output wire [LANES-1:0] crc_wrong,      // the record's CRC does not match
    output reg  [LANES-1:0] tick_wrong      // the record's tick is not the expected one
);
    `include "whisker_protocol.vh"
    `include "crc8.vh"

    // A register that has taken a message and its right CRC holds this, whatever the message.
    localparam [7:0] RESIDUE = crc8_byte(CRC8_XOR_OUT[7:0], 8'h00);

    reg  [LANES-1:0] crc [0:7];  // slice i: bit i of every lane's CRC register
    reg  [7:0]       tick;       // expected bits to come, most significant first
    wire [LANES-1:0] feedback = crc[7] ^ bits;
    wire             in_tick = (bits_index[5:3] == RECORD_TICK[2:0]);

    reg  [LANES-1:0] sampled;       // as read; in the pads
    reg              captured;      // sampled is new
    reg  [5:0]       sampled_index;
    wire [LANES-1:0] own;           // the same bit of pattern_source

    pattern_source #(.LANES(LANES)) source (
        .clk(clk), .clear(clear), .expected_tick(expected_tick), .step(captured), .index(sampled_index), .bits(own));

    always @(posedge clk) begin
        captured   <= capture && !rst;
        bits_valid <= captured && !rst;
        if (capture) begin
            sampled       <= miso;
            sampled_index <= capture_index;
        end
        if (captured) begin
            bits       <= pattern ? own : sampled;
            bits_index <= sampled_index;
        end
    end

    always @(posedge clk)
        if (clear) begin
            absent     <= {LANES{1'b1}};
            tick_wrong <= {LANES{1'b0}};
            tick       <= expected_tick;
        end else if (bits_valid) begin
            absent <= absent & bits;
            if (in_tick) begin
                tick_wrong <= tick_wrong | (bits ^ {LANES{tick[7]}});
                tick       <= {tick[6:0], 1'b0};
            end
        end

    genvar i;
    generate
        for (i = 0; i < 8; i = i + 1) begin : slice
            wire [LANES-1:0] lower = (i == 0) ? {LANES{1'b0}} : crc[(i + 7) % 8];

            always @(posedge clk)
                if (clear) crc[i] <= {LANES{CRC8_INIT[i]}};
                else if (bits_valid) crc[i] <= lower ^ (feedback & {LANES{CRC8_POLYNOMIAL[i]}});
        end
    endgenerate

    assign crc_wrong = (crc[0] ^ {LANES{RESIDUE[0]}}) | (crc[1] ^ {LANES{RESIDUE[1]}})
                     | (crc[2] ^ {LANES{RESIDUE[2]}}) | (crc[3] ^ {LANES{RESIDUE[3]}})
                     | (crc[4] ^ {LANES{RESIDUE[4]}}) | (crc[5] ^ {LANES{RESIDUE[5]}})
                     | (crc[6] ^ {LANES{RESIDUE[6]}}) | (crc[7] ^ {LANES{RESIDUE[7]}});
endmodule

`default_nettype wire
