#include <math.h>
#include <string.h>

#include "whisker/clock.h"
#include "whisker/errors.h"

/* When a tick was, by the start-of-frame packets of the host's USB controller. */
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

/* Whether usb_time says something. */
static bool clock_usb_known(uint16_t usb_time)
{
    return usb_time & KNOWN;
}

/* Begins anew with the next tick. */
static void clock_usb_begin(struct whisker_clock_usb *usb, double nominal_ns)
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

/* The date of a frame's tick, ns. near_ns: about where it is, to a second. Cycles may go back: the bridge was started
 * again, and the controller's time goes on. */
static double clock_usb_date(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, double near_ns)
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

/* A report gives a date exactly, and with the one before the rate. */
static void clock_usb_report(struct whisker_clock_usb *usb, uint64_t cycles, uint16_t usb_time, uint16_t sof_cycles)
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

/* One point per second: at 2 kHz at least a hundred arrivals to choose the fastest from. */
#define POINT_NS 1e9
/* A crystal and a host's clock, disciplined or not, differ by less (typically 100e-6). */
#define SKEW_MAX 500e-6
/* Less than this cannot be distinguished from delay; more, for so many seconds, is no delay any more. */
#define JUMP_EARLY_NS 5e6
#define JUMP_LATE_NS 20e6
#define JUMP_POINTS 3
/* What no arrival shows: the host's least delay from the end of a transfer to its callback. */
#define FLOOR_NS 25e3
/* Until there are points enough, arrivals may all have been held up: as long as a loaded machine was seen to (61 ms).
 */
#define UNKNOWN_NS 60e6
#define POINTS_KNOWN 3
/* A time service slews by 500e-6 at most, so what is more between two arrivals is a step. */
#define REALTIME_STEP_NS INT64_C(10000000)
/* A century: further away no cycle is, and sums stay inside 64 bits. */
#define FAR_NS 3.2e18

void whisker_clock_begin(struct whisker_clock_fit *fit, uint32_t clock_hz, int64_t latency_ns)
{
    memset(fit, 0, sizeof *fit);
    fit->nominal_ns = 1e9 / clock_hz;
    fit->latency_ns = latency_ns;
    clock_usb_begin(&fit->usb, fit->nominal_ns);
}

/* Where a tick is on the axis that arrivals are late behind: the controller's time, or else the bridge's. */
static double clock_place_of(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, int64_t arrival_ns)
{
    const double since_ns = ((double)(arrival_ns - fit->first_ns) - fit->late_ns) / (1 + fit->skew);
    return clock_usb_known(usb_time) ? clock_usb_date(&fit->usb, cycles, usb_time, fit->first_x_ns + since_ns)
                                     : (double)(cycles - fit->first_cycles) * fit->nominal_ns;
}

static void clock_restart(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, int64_t arrival_ns)
{
    fit->restarts += fit->begun;
    fit->begun = true;
    fit->first_cycles = cycles;
    fit->first_ns = arrival_ns;
    clock_usb_begin(&fit->usb, fit->nominal_ns);
    fit->first_x_ns = clock_place_of(fit, cycles, usb_time, arrival_ns);
    fit->points = fit->late_points = 0;
    fit->skew = fit->spread_ns = 0;
    fit->late_ns = fit->usb.doubt_ns;
    fit->best = (struct whisker_clock_point){0, fit->late_ns};
}

/* How far a point lies above the line. */
static double clock_above(const struct whisker_clock_fit *fit, const struct whisker_clock_point *point)
{
    return point->late_ns - (fit->late_ns + fit->skew * point->x_ns);
}

static double clock_slope(const struct whisker_clock_point *a, const struct whisker_clock_point *b)
{
    return (b->late_ns - a->late_ns) / (b->x_ns - a->x_ns);
}

/* The lower convex hull of the points, left to right (Andrew's monotone chain); returns how many are on it. */
static int clock_lower_hull(const struct whisker_clock_point *point, int count,
                            struct whisker_clock_point hull[WHISKER_CLOCK_POINTS])
{
    int on = 0;
    for (int i = 0; i < count; i++) {
        while (on >= 2 && clock_slope(&hull[on - 2], &hull[on - 1]) >= clock_slope(&hull[on - 1], &point[i])) {
            on--;
        }
        hull[on++] = point[i];
    }
    return on;
}

/*
 * Of all lines that no point lies below, the one with the least sum of distances goes along the edge of the lower hull
 * above the mean of x (Moon, Skelly, Towsley 1999: skew by linear programming).
 */
static double clock_envelope_skew(const struct whisker_clock_fit *fit)
{
    struct whisker_clock_point hull[WHISKER_CLOCK_POINTS];
    const int on = clock_lower_hull(fit->point, fit->points, hull);
    double mean = 0;
    for (int i = 0; i < fit->points; i++) {
        mean += fit->point[i].x_ns / fit->points;
    }
    int edge = 1;
    while (edge < on - 1 && hull[edge].x_ns < mean) {
        edge++;
    }
    return on < 2 ? 0 : fmax(-SKEW_MAX, fmin(SKEW_MAX, clock_slope(&hull[edge - 1], &hull[edge])));
}

/* How far the fastest arrivals of a second usually lie above the line: the median. */
static double clock_median_above(const struct whisker_clock_fit *fit)
{
    double sorted[WHISKER_CLOCK_POINTS];
    for (int i = 0; i < fit->points; i++) {
        const double distance = clock_above(fit, &fit->point[i]);
        int at = i;
        for (; at > 0 && sorted[at - 1] > distance; at--) {
            sorted[at] = sorted[at - 1];
        }
        sorted[at] = distance;
    }
    return sorted[fit->points / 2];
}

static void clock_fit_line(struct whisker_clock_fit *fit)
{
    fit->skew = clock_envelope_skew(fit);
    fit->late_ns = INFINITY;
    for (int i = 0; i < fit->points; i++) {
        fit->late_ns = fmin(fit->late_ns, fit->point[i].late_ns - fit->skew * fit->point[i].x_ns);
    }
    fit->spread_ns = clock_median_above(fit);
}

static void clock_keep_best(struct whisker_clock_fit *fit)
{
    if (fit->points == WHISKER_CLOCK_POINTS) {
        fit->points--;
        memmove(fit->point, fit->point + 1, (size_t)fit->points * sizeof fit->point[0]);
    }
    fit->late_points = fit->points > 0 && clock_above(fit, &fit->best) > JUMP_LATE_NS ? fit->late_points + 1 : 0;
    fit->point[fit->points++] = fit->best;
    clock_fit_line(fit);
}

static struct whisker_clock_point clock_point_of(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time,
                                                 int64_t arrival_ns)
{
    const double x_ns = clock_place_of(fit, cycles, usb_time, arrival_ns) - fit->first_x_ns;
    const double doubt_ns = fit->usb.known ? fit->usb.doubt_ns : 0; /* a date too late must not seem a fast arrival */
    return (struct whisker_clock_point){x_ns, (double)(arrival_ns - fit->first_ns) - x_ns + doubt_ns};
}

static void clock_add_point(struct whisker_clock_fit *fit, struct whisker_clock_point now)
{
    if (floor(now.x_ns / POINT_NS) > floor(fit->best.x_ns / POINT_NS)) {
        clock_keep_best(fit);
        fit->best = now;
    } else if (clock_above(fit, &now) < clock_above(fit, &fit->best)) {
        fit->best = now;
    }
    fit->late_ns += fmin(0, clock_above(fit, &now)); /* the line is never above an arrival */
}

/* True if no delay and no crystal explains this arrival. */
static bool clock_jumped(const struct whisker_clock_fit *fit, struct whisker_clock_point now)
{
    return fit->late_points >= JUMP_POINTS || (fit->points >= POINTS_KNOWN && clock_above(fit, &now) < -JUMP_EARLY_NS);
}

int whisker_clock_add(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, int64_t monotonic_ns,
                      int64_t realtime_ns)
{
    const int64_t arrival_ns = monotonic_ns - fit->latency_ns;
    const int64_t offset_ns = realtime_ns - monotonic_ns;
    const int64_t step_ns = offset_ns - fit->realtime_offset_ns;
    const bool back = fit->begun && arrival_ns < fit->last_ns;
    const bool set = fit->begun && (step_ns > REALTIME_STEP_NS || step_ns < -REALTIME_STEP_NS);
    const bool again = cycles < fit->last_cycles;
    const bool known = clock_usb_known(usb_time);
    struct whisker_clock_point now = {0, 0};
    bool anew = !fit->begun || back || known != fit->usb.known || (again && !known);
    if (!anew) {
        now = clock_point_of(fit, cycles, usb_time, arrival_ns);
        anew =
            clock_jumped(fit, now) || (again && clock_above(fit, &now) > JUMP_LATE_NS); /* no bus went on meanwhile */
    }
    if (anew) {
        clock_restart(fit, cycles, usb_time, arrival_ns);
        now = fit->best;
    }
    fit->last_cycles = cycles;
    fit->last_x_ns = now.x_ns;
    fit->last_ns = arrival_ns;
    fit->realtime_offset_ns = offset_ns;
    clock_add_point(fit, now);
    return back || set ? WHISKER_ERROR_HOST_CLOCK : WHISKER_OK;
}

void whisker_clock_report(struct whisker_clock_fit *fit, uint64_t cycles, uint16_t usb_time, uint16_t sof_cycles)
{
    clock_usb_report(&fit->usb, cycles, usb_time, sof_cycles);
}

/* base_ns and a distance, which a bridge's nonsense may make as large as it likes. */
static int64_t clock_plus(int64_t base_ns, double on_ns)
{
    return base_ns + llround(fmax(-FAR_NS, fmin(FAR_NS, on_ns)));
}

void whisker_clock_get(const struct whisker_clock_fit *fit, struct whisker_clock *clock)
{
    *clock = (struct whisker_clock){0};
    if (!fit->begun) {
        return;
    }
    const double x_ns = fit->last_x_ns;
    const double rate_ns = fit->usb.known ? fit->usb.rate_ns : fit->nominal_ns;
    clock->device_cycles = fit->last_cycles;
    clock->monotonic_ns = clock_plus(fit->first_ns, x_ns + fit->late_ns + fit->skew * x_ns);
    clock->realtime_ns = clock->monotonic_ns + fit->realtime_offset_ns;
    clock->ns_per_cycle = rate_ns * (1 + fit->skew);
    clock->uncertainty_ns =
        FLOOR_NS + fit->usb.doubt_ns + (fit->points >= POINTS_KNOWN ? 2 * fit->spread_ns : UNKNOWN_NS);
}

static int64_t clock_shift(const struct whisker_clock *clock, int64_t base_ns, uint64_t cycles)
{
    const double on_ns = (double)(int64_t)(cycles - clock->device_cycles) * clock->ns_per_cycle;
    return clock->ns_per_cycle > 0 ? clock_plus(base_ns, on_ns) : 0;
}

int64_t whisker_clock_to_monotonic(const struct whisker_clock *clock, uint64_t cycles)
{
    return clock_shift(clock, clock->monotonic_ns, cycles);
}

int64_t whisker_clock_to_realtime(const struct whisker_clock *clock, uint64_t cycles)
{
    return clock_shift(clock, clock->realtime_ns, cycles);
}
