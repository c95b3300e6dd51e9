// Two banks of records: one filled bit by bit by all lanes at once, one read byte by byte by the framer. Bit j of every
// byte lives in plane j, a small memory with a word of one bit per lane and one word per byte of the record; so storing
// a bit time is one write, and reading a byte takes the same word of all planes and picks one lane's bit from each.
// Nothing is copied when the banks change over.
//
//   bits[LANES] --> plane 7 [bank, byte] --\
//                   plane 6 [bank, byte] ---> pick lane --> data[7:0]
//                   ...                  --/

`default_nettype none

module record_store #(
    parameter LANES = 28
) (
    input  wire             clk,         // 60 MHz
    input  wire             rst,         // synchronous
    input  wire             swap,        // the bank being written becomes the one that is read
    input  wire             write,       // bits is to be stored
    input  wire [5:0]       bit_index,   // bit of the record, 0 first, most significant bit of each byte first
    input  wire [LANES-1:0] bits,        // that bit of every lane
    input  wire [4:0]       read_lane,   // lane to read
    input  wire [2:0]       read_byte,   // byte of its record, in order of arrival
    output wire [7:0]       read_data    // that byte, in the same cycle
);
    reg bank;  // being written

    always @(posedge clk)
        if (rst) bank <= 1'b0;
        else if (swap) bank <= !bank;

    genvar j;
    generate
        for (j = 0; j < 8; j = j + 1) begin : plane
            reg  [LANES-1:0] word [0:15];
            wire [31:0]      read_word = {{32 - LANES{1'b0}}, word[{!bank, read_byte}]};

            always @(posedge clk)
                if (write && bit_index[2:0] == 3'd7 - j[2:0]) word[{bank, bit_index[5:3]}] <= bits;

            assign read_data[j] = read_word[read_lane];
        end
    endgenerate
endmodule

`default_nettype wire
