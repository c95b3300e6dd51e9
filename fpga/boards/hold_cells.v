// A signal that passes COUNT cells which do nothing but take their time, for inputs that would change too early after the
// clock's edge. Unlike a delay line they are timed by nextpnr; report.py checks that they suffice.
//
//   in --> LUT4 --> ... --> LUT4 --> out

`default_nettype none

module hold_cells #(
    parameter COUNT = 2  // 0: in is out
) (
    input  wire in,
    output wire out
);
    wire [COUNT:0] link;

    assign link[0] = in;
    assign out     = link[COUNT];

    genvar i;
    generate
        for (i = 0; i < COUNT; i = i + 1) begin : step
            (* keep *) LUT4 #(.INIT(16'hAAAA)) same (.A(link[i]), .B(1'b0), .C(1'b0), .D(1'b0), .Z(link[i + 1]));
        end
    endgenerate
endmodule

`default_nettype wire
