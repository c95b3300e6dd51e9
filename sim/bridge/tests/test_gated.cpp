// The bridge as it is simulated, its control endpoint apart and evaluated only where something can change, against a
// model of the whole, cycle by cycle, under traffic drawn at random. `test_bridge_gated STEPS SEED` for more.
#include <cstdlib>

#include "Vwhole_bridge.h"
#include "bridge_model.h"
#include "cmocka_cpp.h"
#include "level_requests.h"

namespace
{

using namespace bridge_sim;

constexpr size_t POPULATED = 5;
constexpr unsigned RESET_CYCLES = 17;
constexpr uint64_t PATIENCE_CYCLES = 1000000;

uint64_t steps_asked = 800, seed_asked = 1;

// Both, on nodes and a flash of their own.
class Pair : public BridgeModel
{
  public:
    Pair(NodeBus &bus, NorFlash &flash, NodeBus &whole_bus, NorFlash &whole_flash)
        : BridgeModel(bus, flash), whole_bus_(whole_bus), whole_flash_(whole_flash)
    {
        whole_.tick_external = 1;
        whole_.miso = UINT32_MAX >> (32 - LANES);
        whole_.eval();
        reset_whole();
        set_compared(true);
    }

    void cycle() override
    {
        BridgeModel::cycle();
        if (compared_) {
            step_whole();
            compare();
        }
    }

    void tick()
    {
        whole_.tick_strobe = 1;
        start_tick();
        whole_.tick_strobe = 0;
    }

    void power_up()
    {
        set_compared(false);
        reset();
        reset_whole();
        set_compared(true);
    }

  private:
    void set_compared(bool compared)
    {
        compared_ = compared;
        if (compared) {
            compare();
        }
    }

    void reset_whole()
    {
        for (unsigned i = 0; i < RESET_CYCLES; i++) {
            whole_.rst = i + 1 < RESET_CYCLES;
            step_whole();
        }
    }

    void step_whole()
    {
        whole_.utmi_rx_data = in.rx_data;
        whole_.utmi_rx_active = in.rx_active;
        whole_.utmi_rx_valid = in.rx_valid;
        whole_.utmi_tx_ready = in.tx_ready;
        whole_.utmi_line_state = in.line_state;
        whole_.clk = 1;
        whole_.eval();
        whole_.clk = 0;
        whole_.eval();
        whole_.miso =
            whole_bus_.pins(whole_.sync, whole_.select_n, whole_.sck, whole_.mosi) & (UINT32_MAX >> (32 - LANES));
        whole_.flash_miso = whole_flash_.step(whole_.flash_cs_n, whole_.flash_sck, whole_.flash_mosi);
    }

    void compare() const
    {
        assert_int_equal(out.tx_data, whole_.utmi_tx_data);
        assert_int_equal(out.tx_valid, whole_.utmi_tx_valid);
        assert_int_equal(out.xcvr_select, whole_.utmi_xcvr_select);
        assert_int_equal(out.term_select, whole_.utmi_term_select);
        assert_int_equal(out.op_mode, whole_.utmi_op_mode);
        assert_int_equal(running(), whole_.running);
        assert_int_equal(link_busy(), whole_.link_busy);
        assert_int_equal(pins(), whole_.sync << 6 | whole_.select_n << 5 | whole_.sck << 4 | whole_.mosi << 3 |
                                     whole_.flash_cs_n << 2 | whole_.flash_sck << 1 | whole_.flash_mosi);
    }

    NodeBus &whole_bus_;
    FlashPins whole_flash_;
    Vwhole_bridge whole_;
    bool compared_ = false;
};

// What a host and the world may do, sensible for the most part.
class Traffic
{
  public:
    explicit Traffic(uint64_t seed)
        : draw_(seed), bus_(POPULATED, seed), whole_bus_(POPULATED, seed),
          pair_(bus_, flash_, whole_bus_, whole_flash_), host_(pair_)
    {
        for (NodeBus *bus : {&bus_, &whole_bus_}) {
            bus->power_on();
        }
        enumerate();
    }

    void step()
    {
        static constexpr struct {
            unsigned weight;
            void (Traffic::*take)();
        } STEPS[] = {{30, &Traffic::request}, {30, &Traffic::tick},          {12, &Traffic::transaction},
                     {10, &Traffic::fault},   {6, &Traffic::noise},          {6, &Traffic::rest},
                     {6, &Traffic::tokens},   {2, &Traffic::start_of_frame}, {1, &Traffic::enumerate},
                     {1, &Traffic::power_up}};
        uint64_t left = draw_.below(104);
        for (const auto &step : STEPS) {
            if (left < step.weight) {
                return (this->*step.take)();
            }
            left -= step.weight;
        }
    }

    void sleep()
    {
        host_.bus().suspend();
        host_.bus().resume(draw_.below(3000));
    }

    Pair &pair()
    {
        return pair_;
    }

    // Bytes of frames.
    uint64_t received() const
    {
        return received_;
    }

    UsbHost &host()
    {
        return host_;
    }

  private:
    HostRequest drawn()
    {
        switch (draw_.below(7)) {
        case 0:
            return draw_.control(draw_.chance(2));
        case 1:
            return draw_.service();
        case 2:
            return draw_.flash();
        case 3:
            return draw_.get();
        case 4:
            return draw_.any();
        case 5:
            return endpoint_request();
        default:
            return draw_.control(true);
        }
    }

    // Is it halted, halt it, let it go on.
    HostRequest endpoint_request()
    {
        static constexpr uint8_t GET_STATUS = 0, CLEAR_FEATURE = 1, SET_FEATURE = 3;
        static constexpr uint8_t NUMBERS[] = {GET_STATUS, CLEAR_FEATURE, SET_FEATURE};
        const uint8_t number = NUMBERS[draw_.below(std::size(NUMBERS))];
        const bool reads = number == GET_STATUS;
        HostRequest request;
        request.setup = {static_cast<uint8_t>(reads ? 0x82 : 0x02), number, 0,
                         static_cast<uint16_t>(draw_.chance(2) ? WHISKER_LIMIT_USB_BULK_IN : WHISKER_LIMIT_USB_HID_IN),
                         static_cast<uint16_t>(reads ? 2 : 0)};
        return request;
    }

    void request()
    {
        HostRequest request = drawn();
        control_transfer(host_, request.setup, request.data);
    }

    // The transfer on the nodes' bus with packets meanwhile.
    void tick()
    {
        for (sim_field &field : fields_) {
            field.alpha_deg = static_cast<double>(draw_.below(60));
        }
        for (NodeBus *bus : {&bus_, &whole_bus_}) {
            bus->set_fields(fields_.data());
        }
        pair_.tick();
        pair_.cycle();
        const uint64_t limit = pair_.cycles + PATIENCE_CYCLES;
        while (pair_.link_busy() && pair_.cycles < limit) {
            draw_.chance(4) ? transaction() : host_.idle(draw_.below(200));
        }
        for (NodeBus *bus : {&bus_, &whole_bus_}) {
            bus->run();
        }
    }

    void transaction()
    {
        Bytes data(draw_.below(65), static_cast<uint8_t>(draw_.below(256)));
        const auto endpoint = static_cast<uint8_t>(draw_.chance(3) ? draw_.below(16) : WHISKER_LIMIT_USB_BULK_IN & 15);
        if (draw_.chance(8)) {
            host_.out(endpoint, data.data(), data.size());
        } else {
            host_.in(endpoint, WHISKER_LIMIT_BULK_PACKET, data);
            received_ += data.size();
        }
    }

    void fault()
    {
        static constexpr WireFault FAULTS[] = {WireFault::LOST_ACK, WireFault::BAD_TOKEN, WireFault::BAD_DATA,
                                               WireFault::BAD_SETUP};
        host_.arm(FAULTS[draw_.below(std::size(FAULTS))]);
    }

    void noise()
    {
        Bytes packet(1 + draw_.below(12));
        for (uint8_t &byte : packet) {
            byte = static_cast<uint8_t>(draw_.below(256));
        }
        if (draw_.chance(2)) {
            const uint64_t pid = draw_.below(16);
            packet[0] = static_cast<uint8_t>(pid | (pid ^ 15) << 4);
        }
        host_.bus().send(packet);
        host_.idle(draw_.below(300));
    }

    void rest()
    {
        host_.idle(draw_.below(3000));
    }

    // Tokens to the device of any kind, with data or without, whatever stage a transfer is in, and perhaps a bus reset.
    void tokens()
    {
        for (uint64_t left = 1 + draw_.below(6); left > 0; left--) {
            const uint64_t pid = draw_.below(16), endpoint = draw_.chance(4) ? draw_.below(16) : 0;
            host_.bus().send(token_packet(static_cast<Pid>(pid | (pid ^ 15) << 4),
                                          static_cast<uint16_t>(host_.address() | endpoint << 7)));
            Bytes data(draw_.chance(2) ? 8 : draw_.below(65));
            for (uint8_t &byte : data) {
                byte = static_cast<uint8_t>(draw_.below(4));
            }
            draw_.chance(2) ? host_.idle(draw_.below(300))
                            : host_.bus().send(data_packet(draw_.chance(2), data.data(), data.size()));
        }
        host_.idle(draw_.below(300));
        if (draw_.chance(8)) {
            host_.reset();
            host_.in(0, 64, data_);
        }
    }

    void start_of_frame()
    {
        host_.start_of_frame();
    }

    void enumerate()
    {
        Descriptors descriptors;
        const char *error = nullptr;
        if (draw_.chance(4)) {
            host_.reset(BusSpeed::FULL);
        } else {
            bridge_sim::enumerate(host_, descriptors, error);
        }
    }

    void power_up()
    {
        pair_.power_up();
        enumerate();
    }

    RequestSource draw_;
    NodeBus bus_, whole_bus_;
    NorFlash flash_, whole_flash_;
    Pair pair_;
    UsbHost host_;
    std::array<sim_field, LANES> fields_{};
    Bytes data_;
    uint64_t received_ = 0;
};

void the_same_in_every_cycle(void **)
{
    Traffic traffic(seed_asked);
    for (uint64_t i = 0; i < steps_asked; i++) {
        traffic.step();
        if (i % 500 == 499) {
            traffic.sleep();
        }
    }
    std::printf("%llu cycles, the control endpoint evaluated in %llu; %llu bytes of frames\n",
                static_cast<unsigned long long>(traffic.pair().cycles),
                static_cast<unsigned long long>(traffic.pair().control_edges()),
                static_cast<unsigned long long>(traffic.received()));
    assert_true(traffic.received() > 0);
}

void at_rest_nothing_is_evaluated(void **)
{
    Traffic traffic(seed_asked);
    traffic.host().idle(1000);
    const uint64_t before = traffic.pair().control_edges();
    traffic.host().idle(10000);
    assert_int_equal(traffic.pair().control_edges(), before);
}

} // namespace

int main(int argc, char **argv)
{
    if (argc == 3) {
        steps_asked = std::strtoull(argv[1], nullptr, 10);
        seed_asked = std::strtoull(argv[2], nullptr, 10);
    }
    const CMUnitTest tests[] = {cmocka_unit_test(the_same_in_every_cycle),
                                cmocka_unit_test(at_rest_nothing_is_evaluated)};
    return cmocka_run_group_tests(tests, nullptr, nullptr);
}
