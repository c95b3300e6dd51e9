#include "bridge_model.h"

#include "Vclocked_bridge.h"
#include "Vclocked_bridge___024root.h"

void Vclocked_bridge___024root___eval_nba(Vclocked_bridge___024root *root); // no header of Verilator's has it

namespace bridge_sim
{

namespace
{

constexpr int RESET_CYCLES = 16;

// Of the model's triggers.
constexpr uint64_t RISING = 1, FALLING = 2;

// What follows an edge of the clock. Verilated::eval() looks for the edge first, and then for another one that the
// first could have caused; the model's clock is an input, and there is no other.
void evaluate(Vclocked_bridge___024root &root, uint64_t edge)
{
    root.__VnbaTriggered[0] = edge;
    Vclocked_bridge___024root___eval_nba(&root);
}

} // namespace

BridgeModel::BridgeModel(NodeBus &bus, NorFlash &flash)
    : bus_(bus), flash_(flash), top_(std::make_unique<Vclocked_bridge>())
{
    top_->tick_external = 1;
    top_->tick_strobe = 0;
    top_->miso = UINT32_MAX >> (32 - LANES);
    top_->eval();
    reset();
}

BridgeModel::~BridgeModel() = default;

void BridgeModel::reset()
{
    top_->rst = 1;
    for (int i = 0; i < RESET_CYCLES; i++) {
        cycle();
    }
    top_->rst = 0;
    cycle();
}

void BridgeModel::start_tick()
{
    top_->tick_strobe = 1;
    cycle();
    top_->tick_strobe = 0;
}

void BridgeModel::tick_by_itself()
{
    top_->tick_external = 0;
}

void BridgeModel::run_nodes_by_itself()
{
    runs_nodes_ = true;
}

// A cycle after the transfer: the nodes see select rise first.
void BridgeModel::run_nodes()
{
    if (ended_) {
        bus_.run();
    }
    ended_ = busy_ && !link_busy();
    busy_ = link_busy();
}

bool BridgeModel::sync() const
{
    return top_->sync;
}

unsigned BridgeModel::pins() const
{
    return top_->sync << 6 | top_->select_n << 5 | top_->sck << 4 | top_->mosi << 3 | top_->flash_cs_n << 2 |
           top_->flash_sck << 1 | top_->flash_mosi;
}

bool BridgeModel::link_busy() const
{
    return top_->link_busy;
}

bool BridgeModel::running() const
{
    return top_->running;
}

// The registers' names as Verilator writes them.
#define REGISTER(name) top_->rootp->clocked_bridge__DOT__bridge__DOT__##name

SamplingSettings BridgeModel::settings() const
{
    return {REGISTER(options), REGISTER(lane_mask), REGISTER(tick_period)};
}

SamplingState BridgeModel::sampling() const
{
    return {REGISTER(tick_number),
            REGISTER(ticker__DOT__tick_time),
            REGISTER(previous_time),
            REGISTER(usb_clock__DOT__frame),
            REGISTER(usb_clock__DOT__microframe),
            REGISTER(usb_time),
            REGISTER(previous_usb_time),
            REGISTER(ticks),
            REGISTER(frames),
            REGISTER(dropped),
            REGISTER(sequence_number),
            REGISTER(records_good),
            REGISTER(records_absent),
            REGISTER(records_crc),
            REGISTER(records_tick)};
}

void BridgeModel::go_on(const SamplingState &state)
{
    REGISTER(tick_number) = state.number;
    REGISTER(ticker__DOT__tick_time) = state.time;
    REGISTER(previous_time) = state.before;
    REGISTER(usb_clock__DOT__frame) = state.usb_frame;
    REGISTER(usb_clock__DOT__microframe) = state.usb_microframe;
    REGISTER(usb_time) = state.usb_time;
    REGISTER(previous_usb_time) = state.usb_time_before;
    REGISTER(ticks) = state.ticks;
    REGISTER(frames) = state.frames;
    REGISTER(dropped) = state.dropped;
    REGISTER(sequence_number) = state.sequence;
    REGISTER(records_good) = state.good;
    REGISTER(records_absent) = state.absent;
    REGISTER(records_crc) = state.crc;
    REGISTER(records_tick) = state.tick;
}

bool BridgeModel::every_frame() const
{
    return REGISTER(options) & WHISKER_CONTROL_OPTION_EVERY_FRAME;
}

uint32_t BridgeModel::tick_period() const
{
    return REGISTER(tick_period);
}

uint32_t BridgeModel::frames_dropped() const
{
    return REGISTER(dropped);
}

// One evaluation (clocked_bridge.v): the edge that ended the cycle before, then the outputs of this one. The falling
// edge clocks nothing but the flash's SCK, which a reset may find high. The node wires answer in between: a record's
// bit is on MISO at the first edge after the SCK edge that shifted it out.
void BridgeModel::cycle()
{
    Vclocked_bridge &top = *top_;
    top.utmi_rx_data = in.rx_data;
    top.utmi_rx_active = in.rx_active;
    top.utmi_rx_valid = in.rx_valid;
    top.utmi_tx_ready = in.tx_ready;
    top.utmi_line_state = in.line_state;
    evaluate(*top.rootp, RISING);
    if (!top.flash_cs_n || top.flash_sck) {
        evaluate(*top.rootp, FALLING);
    }
    out.tx_data = top.utmi_tx_data;
    out.tx_valid = top.utmi_tx_valid;
    out.xcvr_select = top.utmi_xcvr_select;
    out.term_select = top.utmi_term_select;
    out.op_mode = top.utmi_op_mode;
    top.miso = bus_.pins(top.sync, top.select_n, top.sck, top.mosi) & (UINT32_MAX >> (32 - LANES));
    top.flash_miso = flash_.step(top.flash_cs_n, top.flash_sck, top.flash_mosi);
    cycles++;
    if (runs_nodes_) {
        run_nodes();
    }
}

} // namespace bridge_sim
