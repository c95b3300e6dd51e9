// The bridge's patience: frames wait here while the host does not read. Whole frames only: a frame for which there is
// no room at its first byte is dropped to its last byte and counted, and a frame becomes visible to the reader with its
// last byte. A frame marked `keep` (the last of a run, which ends the host's transfer) waits for room instead. If the host
// wants `every` frame at once, each ends its transfer.
//
//   in --[ room for a frame? ]--> memory, 9 bits: data and end of stream --> output register --> out
//             no: drop, count             ^write, commit         ^read

`default_nettype none

module frame_fifo #(
    parameter ADDRESS_BITS = 14,   // 2**ADDRESS_BITS bytes
    parameter FRAME_BYTES  = 256   // of every frame
) (
    input  wire       clk,        // 60 MHz
    input  wire       rst,        // synchronous; empties the FIFO, and a frame half written is gone
    input  wire [7:0] in_data,    // byte of a frame
    input  wire       in_valid,   // in_data is there
    input  wire       in_first,   // it is the frame's first
    input  wire       in_last,    // it is the frame's last
    input  wire       in_keep,    // this frame must not be dropped, and ends the stream: steady through the frame
    input  wire       every,      // each frame ends the stream; read at its last byte
    output wire       in_ready,   // the byte is taken in this cycle
    output wire       dropped,    // a frame is dropped: one cycle
    output reg  [7:0] out_data,   // byte of the stream
    output reg        out_valid,  // out_data is there
    output reg        out_last,   // it ends the stream: the host's transfer is to end here
    input  wire       out_ready   // the byte is taken in this cycle
);
    localparam [ADDRESS_BITS:0] DEPTH = {1'b1, {ADDRESS_BITS{1'b0}}};
    localparam [ADDRESS_BITS:0] FRAME = FRAME_BYTES[ADDRESS_BITS:0];
    localparam [ADDRESS_BITS:0] ONE = {{ADDRESS_BITS{1'b0}}, 1'b1};

    reg [8:0] memory [0:(1 << ADDRESS_BITS) - 1];

    // Positions are counted modulo twice the depth, so that full and empty differ.
    reg  [ADDRESS_BITS:0] write_at;   // next byte to write
    reg  [ADDRESS_BITS:0] commit_at;  // end of the last whole frame
    reg  [ADDRESS_BITS:0] read_at;    // next byte to read
    reg                   dropping;   // the rest of this frame is not stored

    wire [ADDRESS_BITS:0] used = write_at - read_at;
    wire room    = (used <= DEPTH - FRAME);
    wire drop    = in_first ? !room : dropping;
    wire taken   = in_valid && in_ready;
    wire empty   = (read_at == commit_at);
    wire refill  = !out_valid || out_ready;

    assign in_ready = !(in_first && in_keep && !room);
    assign dropped  = taken && in_first && drop;

    always @(posedge clk)
        if (taken && !drop) memory[write_at[ADDRESS_BITS-1:0]] <= {in_last && (in_keep || every), in_data};

    always @(posedge clk)
        if (rst) begin
            write_at  <= {ADDRESS_BITS + 1{1'b0}};
            commit_at <= {ADDRESS_BITS + 1{1'b0}};
            dropping  <= 1'b1;
        end else if (taken) begin
            dropping <= drop;
            if (!drop) begin
                write_at <= write_at + ONE;
                if (in_last) commit_at <= write_at + ONE;
            end
        end

    always @(posedge clk)
        if (refill && !empty) {out_last, out_data} <= memory[read_at[ADDRESS_BITS-1:0]];

    always @(posedge clk)
        if (rst) begin
            read_at   <= {ADDRESS_BITS + 1{1'b0}};
            out_valid <= 1'b0;
        end else if (refill) begin
            out_valid <= !empty;
            if (!empty) read_at <= read_at + ONE;
        end
endmodule

`default_nettype wire
