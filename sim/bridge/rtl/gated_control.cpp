#include "gated_control.h"

#include <cstring>

#include "Vclocked_bridge___024root.h"
#include "Vcontrol_endpoint.h"
#include "Vcontrol_endpoint___024root.h"
#include "control_ports.h"

// No header of Verilator's has these. `ico`: what follows from inputs without a clock edge.
void Vclocked_bridge___024root___ico_sequent__TOP__0(Vclocked_bridge___024root *root);
void Vcontrol_endpoint___024root___ico_sequent__TOP__0(Vcontrol_endpoint___024root *root);
void Vcontrol_endpoint___024root___eval_nba(Vcontrol_endpoint___024root *root);

// A port where the endpoint was cut out of the bridge.
#define SLOT(port)                                                                                                     \
    bridge_.clocked_bridge__DOT__bridge__DOT__usb__DOT__usb__DOT__device__DOT__ControlEndpoint__DOT__##port

namespace bridge_sim
{

GatedControl::GatedControl(Vclocked_bridge___024root &bridge)
    : bridge_(bridge), model_(std::make_unique<Vcontrol_endpoint>()), before_(sizeof(Vcontrol_endpoint___024root))
{
    model_->eval();
}

GatedControl::~GatedControl() = default;

void GatedControl::edge()
{
    if (!resting_) {
        edges_++;
        model_->rootp->__VnbaTriggered[0] = 1;
        Vcontrol_endpoint___024root___eval_nba(model_->rootp);
    }
    settle();
}

void GatedControl::settle()
{
    bool evaluated = !resting_;
    for (;;) {
        if (inputs_moved()) {
            Vcontrol_endpoint___024root___ico_sequent__TOP__0(model_->rootp);
            evaluated = true;
        }
        if (!evaluated) {
            return;
        }
        if (!outputs_moved()) {
            break;
        }
        Vclocked_bridge___024root___ico_sequent__TOP__0(&bridge_);
    }
    resting_ = at_rest();
}

uint64_t GatedControl::edges() const
{
    return edges_;
}

// Most often nothing has moved, and nothing is written.
bool GatedControl::inputs_moved()
{
    uint64_t moved = 0;
#define COMPARE(port) moved |= model_->port ^ SLOT(port);
    CUT_INPUTS(COMPARE)
#undef COMPARE
    if (moved == 0) {
        return false;
    }
#define COPY(port) model_->port = SLOT(port);
    CUT_INPUTS(COPY)
#undef COPY
    return true;
}

bool GatedControl::outputs_moved()
{
    uint64_t moved = 0;
#define COPY(port)                                                                                                     \
    moved |= model_->port ^ SLOT(port);                                                                                \
    SLOT(port) = model_->port;
    CUT_OUTPUTS(COPY)
#undef COPY
    return moved != 0;
}

// Registers, inputs and all between them are members of the model.
bool GatedControl::at_rest()
{
    const auto *now = static_cast<const void *>(model_->rootp);
    if (std::memcmp(before_.data(), now, before_.size()) == 0) {
        return true;
    }
    std::memcpy(before_.data(), now, before_.size());
    return false;
}

} // namespace bridge_sim
