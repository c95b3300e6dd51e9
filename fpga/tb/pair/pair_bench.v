// Bench top: two bridges, each with a clock and a host of its own; the second's tick_in hears the first's tick_out through
// what the bench puts between them.

`default_nettype none
`timescale 1ps / 1ps

module pair_bench #(
    parameter LANES = 1
) (
    input  wire a_clk,
    input  wire b_clk,
    input  wire a_rst,
    input  wire b_rst,
    input  wire cable,    // tick_in of the second
    output wire tick_out, // of the first
    output wire a_sync,
    output wire b_sync
);

    whisker_bridge #(.LANES(LANES)) a (
        .clk(a_clk), .rst(a_rst), .sync(a_sync), .sck(), .select_n(), .mosi(), .miso({LANES{1'b1}}),
        .utmi_rx_data(8'd0), .utmi_rx_active(1'b0), .utmi_rx_valid(1'b0), .utmi_rx_error(1'b0), .utmi_tx_data(),
        .utmi_tx_valid(), .utmi_tx_ready(1'b0), .utmi_line_state(2'd0), .utmi_vbus_valid(1'b1),
        .utmi_session_valid(1'b1), .utmi_session_end(1'b0), .utmi_xcvr_select(), .utmi_term_select(),
        .utmi_op_mode(), .serial_number(64'd0), .tick_external(1'b0), .tick_strobe(1'b0), .tick_in(1'b0),
        .tick_out(tick_out), .running(), .link_busy(), .transfer_busy(), .usb_configured(), .frames_lost(),
        .led());

    whisker_bridge #(.LANES(LANES)) b (
        .clk(b_clk), .rst(b_rst), .sync(b_sync), .sck(), .select_n(), .mosi(), .miso({LANES{1'b1}}),
        .utmi_rx_data(8'd0), .utmi_rx_active(1'b0), .utmi_rx_valid(1'b0), .utmi_rx_error(1'b0), .utmi_tx_data(),
        .utmi_tx_valid(), .utmi_tx_ready(1'b0), .utmi_line_state(2'd0), .utmi_vbus_valid(1'b1),
        .utmi_session_valid(1'b1), .utmi_session_end(1'b0), .utmi_xcvr_select(), .utmi_term_select(),
        .utmi_op_mode(), .serial_number(64'd0), .tick_external(1'b0), .tick_strobe(1'b0), .tick_in(cable),
        .tick_out(), .running(), .link_busy(), .transfer_busy(), .usb_configured(), .frames_lost(),
        .led());
endmodule

`default_nettype wire
