// Stands in for the generated USB device: the same ports, driven and read by the bench through the hierarchy.

`default_nettype none

module whisker_usb (
    input  wire       clk,
    input  wire       rst,
    input  wire [7:0] utmi_rx_data,
    input  wire       utmi_rx_active,
    input  wire       utmi_rx_valid,
    input  wire       utmi_rx_error,
    output reg  [7:0] utmi_tx_data,
    output reg        utmi_tx_valid,
    input  wire       utmi_tx_ready,
    input  wire [1:0] utmi_line_state,
    input  wire       utmi_vbus_valid,
    input  wire       utmi_session_valid,
    input  wire       utmi_session_end,
    output reg  [1:0] utmi_xcvr_select,
    output reg        utmi_term_select,
    output reg  [1:0] utmi_op_mode,
    input  wire [63:0] serial_number,
    output reg        suspended,
    output reg        sof,
    output reg [10:0] sof_frame,
    output reg        configured,
    output reg [7:0]  board,
    output reg [15:0] build,
    output reg        read_open,
    input  wire [7:0] stream_data,
    input  wire       stream_valid,
    input  wire       stream_last,
    output reg        stream_ready,
    output reg        restart,
    output reg        write_start,
    output reg        write_valid,
    output reg  [5:0] write_index,
    output reg  [7:0] write_data,
    output reg        write_done,
    input  wire       write_accept,
    output reg        read_start,
    output reg  [7:0] read_id,
    output reg  [1:0] read_packet,
    output reg        read_next,
    input  wire [7:0] read_data
);
    initial read_packet = 2'd0;
    initial {sof, configured, read_open, sof_frame, board, build} = 38'd0;
    initial {suspended, stream_ready, restart, write_start, write_valid, write_done, read_start, read_next} = 8'd0;

    initial {utmi_tx_data, utmi_tx_valid, utmi_xcvr_select, utmi_term_select, utmi_op_mode} = 14'd0;
endmodule

`default_nettype wire
