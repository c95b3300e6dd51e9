#include "information.h"

#include <math.h>

void nav_information_shares(float share[NAV_INFORMATION_LEVELS])
{
    for (int k = 0; k < NAV_INFORMATION_LEVELS; k++)
        share[k] = expf(-(float)k / NAV_INFORMATION_PER_NAT);
}

bool nav_information_differ(uint8_t *restrict apart, int n, int stride, const uint8_t *restrict codes, uint8_t slack,
                            uint8_t units)
{
    bool differs = false;
    for (int i = 1; i < n && !differs; i++)
        differs = codes[i] != codes[0];
    for (int i = 0; i < n && differs; i++) {
        uint8_t *row = apart + (long)i * stride;
        uint8_t own = codes[i];
        if (own == NAV_INFORMATION_NOTHING)
            continue;
        for (int j = 0; j < n; j++) {
            uint8_t other = codes[j];
            uint8_t off = (uint8_t)((other > own ? other : own) - (other > own ? own : other));
            uint8_t more = (uint8_t)(off > slack && other != NAV_INFORMATION_NOTHING ? units : 0);
            uint8_t most = (uint8_t)(255 - more);
            row[j] = (uint8_t)((row[j] < most ? row[j] : most) + more);
        }
    }
    return differs;
}

bool nav_information_refute(uint8_t *restrict apart, int n, int stride, const uint8_t *restrict stopped, uint8_t units)
{
    int count = 0;
    for (int i = 0; i < n; i++)
        count += stopped[i];
    if (count == 0 || count == n)
        return false;
    for (int i = 0; i < n; i++) {
        uint8_t *row = apart + (long)i * stride;
        if (stopped[i])
            continue;
        for (int j = 0; j < n; j++) {
            uint8_t more = (uint8_t)(stopped[j] ? units : 0), most = (uint8_t)(255 - more);
            row[j] = (uint8_t)((row[j] < most ? row[j] : most) + more);
        }
    }
    return true;
}

double nav_information_bits(const uint8_t *apart, const uint8_t *same, int n, int stride, int first, int last,
                            const float share[NAV_INFORMATION_LEVELS])
{
    double bits = 0.0;
    for (int i = first; i < last; i++) {
        const uint8_t *row = apart + (long)i * stride, *here = same + (long)i * stride;
        float all = 0.0F, within = 0.0F, held = 0.0F;
        for (int j = 0; j < n; j++) {
            float likely = share[row[j]];
            all += likely;
            within += likely * (float)here[j];
            held += (float)here[j];
        }
        bits -= log2((double)(all * held / (within * (float)n)));
    }
    return bits / (last - first);
}
