// Bench top: the USB device behind ulpi_shim, as on a board, without the bridge. Report registers read zero and every
// report is refused.

`default_nettype none

module ulpi_device (
    input  wire       clk,
    input  wire       rst,
    input  wire [7:0] ulpi_data_in,
    output wire [7:0] ulpi_data_out,
    input  wire       ulpi_dir,
    input  wire       ulpi_nxt,
    output wire       ulpi_stp,
    output wire       ready,
    input  wire [7:0] stream_data,
    input  wire       stream_valid,
    output wire       stream_ready,
    output wire       restart,
    output wire       suspended
);
    wire [7:0] rx_data, tx_data;
    wire       rx_active, rx_valid, rx_error, tx_valid, tx_ready, vbus_valid, session_valid, session_end, term_select;
    wire [1:0] line_state, xcvr_select, op_mode;

    ulpi_shim shim (
        .clk(clk), .rst(rst), .ulpi_data_in(ulpi_data_in), .ulpi_data_out(ulpi_data_out),
        .ulpi_dir(ulpi_dir), .ulpi_nxt(ulpi_nxt), .ulpi_stp(ulpi_stp),
        .ready(ready), .utmi_rx_data(rx_data), .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid),
        .utmi_rx_error(rx_error), .utmi_tx_data(tx_data), .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready),
        .utmi_line_state(line_state), .utmi_vbus_valid(vbus_valid), .utmi_session_valid(session_valid),
        .utmi_session_end(session_end), .utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select),
        .utmi_op_mode(op_mode));

    whisker_usb usb (
        .clk(clk), .rst(rst), .utmi_rx_data(rx_data), .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid),
        .utmi_rx_error(rx_error), .utmi_tx_data(tx_data), .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready),
        .utmi_line_state(line_state), .utmi_vbus_valid(vbus_valid), .utmi_session_valid(session_valid),
        .utmi_session_end(session_end), .utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select),
        .utmi_op_mode(op_mode), .stream_data(stream_data), .stream_valid(stream_valid), .stream_last(1'b0),
        .stream_ready(stream_ready), .restart(restart), .suspended(suspended), .board(), .build(), .configured(), .sof(), .sof_frame(), .read_open(),
        .serial_number(64'd0),
        .write_start(), .write_valid(), .write_index(), .write_data(), .write_done(), .write_accept(1'b0),
        .read_start(), .read_id(), .read_packet(), .read_next(), .read_data(8'd0));
endmodule

`default_nettype wire
