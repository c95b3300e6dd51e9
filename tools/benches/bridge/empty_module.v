// As many registers as a bridge's, and nothing between them: what Verilator's clock costs by itself.

`default_nettype none

module empty_module #(
    parameter REGISTERS = 2048
) (
    input  wire clk,
    input  wire in,
    output wire out
);
    reg [63:0] words [0:REGISTERS/64-1];
    integer    i;

    always @(posedge clk) begin
        words[0] <= {words[0][62:0], in};
        for (i = 1; i < REGISTERS / 64; i = i + 1) words[i] <= words[i-1];
    end

    assign out = words[REGISTERS/64-1][63];
endmodule

`default_nettype wire
