// What every board with a ULPI PHY has: the bridge, the shim to its PHY, a watchdog on the PHY's clock, LEDs, and a reset of 16
// cycles after configuration and after the clock was lost. The pads are the board's own (usb3300_board.v, cynthion.v).
//
//   nodes <--> whisker_bridge <-- UTMI --> ulpi_shim <--> pads <--> PHY
//                    ^---- rst <-- power-up counter <-- phy_watch --> ulpi_reset

`default_nettype none

module board_core #(
    parameter       LANES           = 28,
    parameter [7:0] FLASH_SECTORS   = 8'd0,  // see whisker_bridge
    parameter [5:0] VENDOR_REGISTER = 6'h00, // of the PHY, see ulpi_shim
    parameter [7:0] VENDOR_VALUE    = 8'h00,
    parameter       BLINK_BITS      = 21     // see status_leds
) (
    input  wire             clk,            // 60 MHz, the PHY's
    input  wire             osc,            // of the FPGA itself, see phy_watch
    input  wire [7:0]       ulpi_data_in,   // pads
    output wire [7:0]       ulpi_data_out,  // .
    input  wire             ulpi_dir,       // .
    input  wire             ulpi_nxt,       // .
    output wire             ulpi_stp,       // .
    output wire             ulpi_reset,     // . 1: reset the PHY
    output wire             sync,           // the nodes' bus, see whisker_bridge
    output wire             sck,            // .
    output wire             select_n,       // .
    output wire             mosi,           // .
    input  wire [LANES-1:0] miso,           // .
    input  wire             tick_in,        // . 0 where a board has no pin for it
    output wire             tick_out,       // .
    output wire             flash_cs_n,     // configuration flash
    output wire             flash_sck,      // .
    output wire             flash_mosi,     // .
    input  wire             flash_miso,     // . 0 where FLASH_SECTORS is
    output wire [3:0]       leds,           // see status_leds
    output wire             led             // . for a board that has one
);
    wire [7:0] rx_data, tx_data;
    wire       rx_active, rx_valid, rx_error, tx_valid, tx_ready, vbus_valid, session_valid, session_end, term_select;
    wire [1:0] line_state, xcvr_select, op_mode;
    wire       ready, running, link_busy, transfer_busy, configured, frames_lost, lit;
    wire       unused = &{1'b0, link_busy, transfer_busy, lit};

    // Flip-flops begin at zero when the FPGA has been configured.
    reg  [4:0] awake;
    reg  [1:0] lost;
    wire       clock_lost;
    wire       rst = !awake[4];
    initial {awake, lost} = 7'd0;
    always @(posedge clk) begin
        lost <= {lost[0], clock_lost};
        if (lost[1]) awake <= 5'd0;
        else if (rst) awake <= awake + 5'd1;
    end

    phy_watch watch (.osc(osc), .clk(clk), .lost(clock_lost), .phy_reset(ulpi_reset));

    status_leds #(.BITS(BLINK_BITS)) status (
        .osc(osc), .clock_lost(clock_lost), .ready(ready), .configured(configured), .running(running),
        .trouble(frames_lost), .leds(leds), .one(led));

    ulpi_shim #(.VENDOR_REGISTER(VENDOR_REGISTER), .VENDOR_VALUE(VENDOR_VALUE)) shim (
        .clk(clk), .rst(rst), .ulpi_data_in(ulpi_data_in), .ulpi_data_out(ulpi_data_out),
        .ulpi_dir(ulpi_dir), .ulpi_nxt(ulpi_nxt), .ulpi_stp(ulpi_stp), .ready(ready), .utmi_rx_data(rx_data),
        .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid), .utmi_rx_error(rx_error), .utmi_tx_data(tx_data),
        .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready), .utmi_line_state(line_state), .utmi_vbus_valid(vbus_valid),
        .utmi_session_valid(session_valid), .utmi_session_end(session_end), .utmi_xcvr_select(xcvr_select),
        .utmi_term_select(term_select), .utmi_op_mode(op_mode));

    whisker_bridge #(.LANES(LANES), .FLASH_SECTORS(FLASH_SECTORS)) bridge (
        .clk(clk), .rst(rst), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi), .miso(miso),
        .utmi_rx_data(rx_data), .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid), .utmi_rx_error(rx_error),
        .utmi_tx_data(tx_data), .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready), .utmi_line_state(line_state),
        .utmi_vbus_valid(vbus_valid), .utmi_session_valid(session_valid), .utmi_session_end(session_end),
        .utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select), .utmi_op_mode(op_mode),
        .serial_number(64'd0), .tick_external(1'b0), .tick_strobe(1'b0), .tick_in(tick_in), .tick_out(tick_out),
        .usb_configured(configured), .frames_lost(frames_lost), .running(running), .link_busy(link_busy),
        .transfer_busy(transfer_busy), .led(lit), .flash_cs_n(flash_cs_n), .flash_sck(flash_sck),
        .flash_mosi(flash_mosi), .flash_miso(flash_miso));
endmodule

`default_nettype wire
