#include "angle.h"

#include "rp2040.h"

#define REST 0x8000
#define QUARTER 0x8000 /* counts of 90 degrees */

/* atan(t) for 0 <= t <= 1: t (C1 + C3 t^2 + C5 t^4 + C7 t^6 + C9 t^8), within 1e-5 rad (Abramowitz, Stegun, 4.4.47), in
 * quarters of a count, of pi / 65536 rad; the last one such that 45 degrees are exact. */
#define C1 83432
#define C3 (-27561)
#define C5 15032
#define C7 (-7104)
#define C9 1737

/* The divider serves one at a time: nothing that interrupts this divides. */
static uint32_t angle_divide(uint32_t dividend, uint32_t divisor)
{
    REG(SIO_DIVIDEND) = dividend;
    REG(SIO_DIVISOR) = divisor;
    __asm volatile("nop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop");
    return REG(SIO_QUOTIENT);
}

static int32_t angle_times(int32_t a, int32_t t2)
{
    return (a * t2 + 0x8000) >> 16;
}

/* Of two sides, not negative, the first at most as long as the second. */
static int32_t angle_small(uint32_t opposite, uint32_t adjacent)
{
    const uint32_t t = angle_divide((opposite << 16) + adjacent / 2u, adjacent); /* 65536: 1 */
    const int32_t t2 = (int32_t)((t / 2u) * (t / 2u) >> 14);
    const int32_t sum = C1 + angle_times(C3 + angle_times(C5 + angle_times(C7 + angle_times(C9, t2), t2), t2), t2);
    const uint32_t whole = (uint32_t)sum / 4u, quarters = (uint32_t)sum % 4u;
    return (int32_t)((whole * t + (quarters * t / 4u) + 0x8000u) >> 16);
}

uint16_t angle_of(int32_t side, int32_t axis)
{
    const uint32_t s = (uint32_t)(side < 0 ? -side : side), a = (uint32_t)(axis < 0 ? -axis : axis);
    if (s == 0)
        return REST;
    const int32_t angle = s <= a ? angle_small(s, a) : QUARTER - angle_small(a, s);
    return (uint16_t)((side < 0) != (axis < 0) ? REST - angle : angle == QUARTER ? UINT16_MAX : REST + angle);
}

uint32_t angle_strength(const struct field *f)
{
    return (uint32_t)(f->x * f->x) + (uint32_t)(f->y * f->y) + (uint32_t)(f->z * f->z);
}
