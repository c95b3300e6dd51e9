#include "clock_usb.h"

#include <math.h>

#define KNOWN 0x8000u
#define WRAP 0x4000 /* microframes, after which usb_time counts anew */
#define MICROFRAME_NS 125e3
#define PER_FRAME 8
/* The bridge counts ticks that are further off as uneven. */
#define RATE_MAX (1.0 / 64)
/* Rates of two successive reports differ by less if the ticks are even. */
#define RATE_STEP 20e-6
/* A date may be so far outside its microframe by the drift since the last one. */
#define DRIFT_NS 5e3

bool clock_usb_known(uint16_t usb_time)
{
    return usb_time & KNOWN;
}

void clock_usb_begin(struct whisker_clock_usb *usb, double nominal_ns)
{
    *usb = (struct whisker_clock_usb){.nominal_ns = nominal_ns, .rate_ns = nominal_ns};
}

/* The microframe of this number that is nearest to one counted on. */
static int64_t clock_usb_unwrap(uint16_t usb_time, double near)
{
    const int64_t number = usb_time & (WRAP - 1);
    const double wraps = fmax(-1e12, fmin(1e12, (near - (double)number) / WRAP));
    return number + WRAP * llround(wraps);
}

static void clock_usb_set_date(struct whisker_clock_usb *usb, uint64_t cycles, double ns, double doubt_ns)
{
    usb->cycles = cycles;
    usb->ns = ns;
    usb->doubt_ns = doubt_ns;
}

static double clock_usb_predict(const struct whisker_clock_usb *usb, uint64_t cycles)
{
    return usb->ns + (double)(int64_t)(cycles - usb->cycles) * usb->rate_ns;
}

double clock_usb_date(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, double near_ns)
{
    usb->microframe = clock_usb_unwrap(usb_time, usb->known ? near_ns / MICROFRAME_NS : 0);
    usb->known = true;
    usb->microframes |= usb_time % PER_FRAME != 0;
    const double width_ns = usb->microframes ? MICROFRAME_NS : PER_FRAME * MICROFRAME_NS;
    const double first_ns = (double)usb->microframe * MICROFRAME_NS;
    const double expected_ns = clock_usb_predict(usb, cycles);
    const double within_ns = fmax(first_ns, fmin(first_ns + width_ns, expected_ns));
    usb->even &= fabs(within_ns - expected_ns) < DRIFT_NS;
    if (usb->even) {
        clock_usb_set_date(usb, cycles, within_ns, 0);
    } else {
        clock_usb_set_date(usb, cycles, first_ns + width_ns / 2, width_ns / 2);
    }
    return usb->ns;
}

void clock_usb_report(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, uint16_t sof_cycles)
{
    if (!usb->known || !clock_usb_known(usb_time)) {
        return;
    }
    const double ns =
        (double)clock_usb_unwrap(usb_time, (double)usb->microframe) * MICROFRAME_NS + sof_cycles * usb->nominal_ns;
    const double rate_ns = (ns - usb->report_ns) / (double)(int64_t)(cycles - usb->report_cycles);
    const bool possible = usb->reported && fabs(rate_ns / usb->nominal_ns - 1) < RATE_MAX;
    usb->even = possible && fabs(rate_ns / usb->rate_ns - 1) < RATE_STEP;
    usb->rate_ns = possible ? rate_ns : usb->nominal_ns;
    usb->report_cycles = cycles;
    usb->report_ns = ns;
    usb->reported = true;
    clock_usb_set_date(usb, cycles, ns, 0);
}
