// Pads of a ULX3S: its second USB socket (US2) goes to pins of the FPGA, so the PHY is gateware and full speed is all there is.
// One PLL gives 60 MHz for everything and 48 MHz for the PHY's sampling, out of the board's 25 MHz.
//
//   clk_25 --> EHXPLLL --> clk_60, clk_48        US2 <--> pads <--> whisker_fs_phy <-- UTMI --> whisker_bridge <--> nodes

`default_nettype none

module ulx3s #(
    parameter       LANES         = 28,
    parameter [7:0] FLASH_SECTORS = 8'd0  // see whisker_bridge
) (
    input  wire             clk_25,
    inout  wire             usb_d_p,
    inout  wire             usb_d_n,
    output wire             usb_pull_up,
    output wire             sync,
    output wire             sck,
    output wire             select_n,
    output wire             mosi,
    input  wire [LANES-1:0] miso,
    input  wire             tick_in,  // pulled down: another bridge's tick_out, a camera, a PPS
    output wire             tick_out, // to another bridge's tick_in
    output wire [3:0]       led,
    output wire [1:0]       flash_high, // the configuration flash's WP and HOLD
    output wire             flash_cs_n, // . its clock is no pin of ours but USRMCLK
    output wire             flash_mosi,
    input  wire             flash_miso
);
    wire       clk_60, clk_48, locked, osc, lit, one;
    wire       d_p_in, d_p_out, d_p_oe, d_n_in, d_n_out, d_n_oe;
    wire [7:0] rx_data, tx_data;
    wire       rx_active, rx_valid, rx_error, tx_valid, tx_ready, term_select;
    wire [1:0] line_state, xcvr_select, op_mode;
    wire       running, link_busy, transfer_busy, configured, frames_lost, flash_sck;
    wire       unused = &{1'b0, link_busy, transfer_busy, lit, one};

    assign flash_high = 2'b11;

    (* keep *) USRMCLK flash_clock (.USRMCLKI(flash_sck), .USRMCLKTS(FLASH_SECTORS == 8'd0));

    // 25 MHz / 5 * 12 * 8 = 480 MHz, over 8 and over 10
    (* keep *) EHXPLLL #(
        .CLKI_DIV(5), .CLKFB_DIV(12), .CLKOP_DIV(8), .CLKOS_DIV(10), .CLKOP_ENABLE("ENABLED"), .CLKOS_ENABLE("ENABLED"),
        .CLKOP_CPHASE(7), .CLKOS_CPHASE(9), .FEEDBK_PATH("CLKOP")
    ) pll (
        .CLKI(clk_25), .CLKFB(clk_60), .RST(1'b0), .STDBY(1'b0), .PHASESEL0(1'b0), .PHASESEL1(1'b0), .PHASEDIR(1'b0),
        .PHASESTEP(1'b0), .PHASELOADREG(1'b0), .PLLWAKESYNC(1'b0), .ENCLKOP(1'b0), .ENCLKOS(1'b0), .CLKOP(clk_60),
        .CLKOS(clk_48), .LOCK(locked));

    reg  [4:0] awake;
    reg  [1:0] stable;
    wire       rst = !awake[4];
    initial {awake, stable} = 7'd0;
    always @(posedge clk_60) begin
        stable <= {stable[0], locked};
        if (!stable[1]) awake <= 5'd0;
        else if (rst) awake <= awake + 5'd1;
    end

    (* keep *) OSCG #(.DIV(128)) oscillator (.OSC(osc));

    status_leds status (
        .osc(osc), .clock_lost(!locked), .ready(!rst), .configured(configured), .running(running), .trouble(frames_lost),
        .leds(led), .one(one));

    BB d_p_pad (.B(usb_d_p), .I(d_p_out), .T(!d_p_oe), .O(d_p_in));
    BB d_n_pad (.B(usb_d_n), .I(d_n_out), .T(!d_n_oe), .O(d_n_in));

    whisker_fs_phy phy (
        .clk(clk_60), .rst(rst), .clk_48(clk_48), .rst_48(1'b0), .d_p_i(d_p_in), .d_p_o(d_p_out), .d_p_oe(d_p_oe),
        .d_n_i(d_n_in), .d_n_o(d_n_out), .d_n_oe(d_n_oe), .pull_up(usb_pull_up), .utmi_rx_data(rx_data),
        .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid), .utmi_rx_error(rx_error), .utmi_tx_data(tx_data),
        .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready), .utmi_line_state(line_state),
        .utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select), .utmi_op_mode(op_mode));

    whisker_bridge #(.LANES(LANES), .FLASH_SECTORS(FLASH_SECTORS)) bridge (
        .clk(clk_60), .rst(rst), .sync(sync), .sck(sck), .select_n(select_n), .mosi(mosi), .miso(miso),
        .utmi_rx_data(rx_data), .utmi_rx_active(rx_active), .utmi_rx_valid(rx_valid), .utmi_rx_error(rx_error),
        .utmi_tx_data(tx_data), .utmi_tx_valid(tx_valid), .utmi_tx_ready(tx_ready), .utmi_line_state(line_state),
        .utmi_vbus_valid(1'b1), .utmi_session_valid(1'b1), .utmi_session_end(1'b0),
        .utmi_xcvr_select(xcvr_select), .utmi_term_select(term_select), .utmi_op_mode(op_mode),
        .serial_number(64'd0), .tick_external(1'b0), .tick_strobe(1'b0), .tick_in(tick_in), .tick_out(tick_out),
        .usb_configured(configured), .frames_lost(frames_lost), .running(running), .link_busy(link_busy),
        .transfer_busy(transfer_busy), .led(lit), .flash_cs_n(flash_cs_n), .flash_sck(flash_sck),
        .flash_mosi(flash_mosi), .flash_miso(flash_miso));
endmodule

`default_nettype wire
