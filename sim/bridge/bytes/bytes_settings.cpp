#include "bytes_settings.h"

namespace bridge_sim
{

LinkSettings LinkSettings::of_report(const Bytes &report)
{
    LinkSettings settings;
    settings.sck_divider = report[WHISKER_REPORT_CONTROL_SCK_DIVIDER];
    settings.word_gap = report[WHISKER_REPORT_CONTROL_WORD_GAP];
    settings.sample_point = report[WHISKER_REPORT_CONTROL_SAMPLE_POINT];
    settings.options = report[WHISKER_REPORT_CONTROL_OPTIONS];
    settings.lane_mask = whisker_get_u32(report.data() + WHISKER_REPORT_CONTROL_LANE_MASK);
    settings.tick_period = whisker_get_u32(report.data() + WHISKER_REPORT_CONTROL_TICK_PERIOD);
    return settings;
}

void LinkSettings::put(Bytes &report) const
{
    report[WHISKER_REPORT_CONTROL_SCK_DIVIDER] = sck_divider;
    report[WHISKER_REPORT_CONTROL_WORD_GAP] = word_gap;
    report[WHISKER_REPORT_CONTROL_SAMPLE_POINT] = sample_point;
    report[WHISKER_REPORT_CONTROL_OPTIONS] = options;
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_LANE_MASK, lane_mask);
    whisker_put_u32(report.data() + WHISKER_REPORT_CONTROL_TICK_PERIOD, tick_period);
}

bool LinkSettings::valid() const
{
    constexpr uint8_t all = WHISKER_CONTROL_OPTION_TICK_IN | WHISKER_CONTROL_OPTION_FALLING |
                            WHISKER_CONTROL_OPTION_EVERY_FRAME | WHISKER_CONTROL_OPTION_PATTERN;
    const bool divider = sck_divider >= WHISKER_LIMIT_SCK_DIVIDER_MIN && sck_divider <= WHISKER_LIMIT_SCK_DIVIDER_MAX &&
                         sck_divider % 2 == 0;
    const bool sample = sample_point >= 1 && sample_point <= sck_divider;
    return divider && sample && (options | all) == all && word_gap >= WHISKER_LIMIT_WORD_GAP_MIN &&
           lane_mask >> WHISKER_LIMIT_LANES == 0 && tick_period >= WHISKER_LIMIT_TICK_PERIOD_MIN;
}

bool LinkSettings::service_fits() const
{
    return sck_divider <= WHISKER_LIMIT_SCK_DIVIDER_DEFAULT && word_gap <= WHISKER_LIMIT_WORD_GAP_DEFAULT &&
           tick_period >= WHISKER_LIMIT_SERVICE_TICK_MIN;
}

} // namespace bridge_sim
