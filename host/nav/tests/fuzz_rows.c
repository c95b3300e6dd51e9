/* libFuzzer target: rows of any bytes into every filter. The first byte chooses the filter, the others are cells: a
 * byte below 16 names an odd value, any other begins a double. Whatever comes, answers are finite and covariances have
 * a positive diagonal. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "filter.h"
#include "rooms.h"

static const double ODD[16] = {NAN,  INFINITY, -INFINITY, 0.0,  -0.0, 1e300, -1e300, 5e-324,
                               1e-9, 0.1,      -0.1,      0.05, 1.0,  -1.0,  0.02,   -7.0};

struct input {
    const uint8_t *at, *end;
};

static double cell(struct input *in)
{
    double value = NAN;
    if (in->at == in->end)
        return value;
    if (*in->at < 16)
        return ODD[*in->at++];
    size_t left = (size_t)(in->end - in->at), size = left < sizeof value ? left : sizeof value;
    memcpy(&value, in->at, size);
    in->at += size;
    return value;
}

static void must(int holds)
{
    if (!holds)
        abort();
}

static void check(const struct nav_estimate *e)
{
    must(isfinite(e->pose.x) && isfinite(e->pose.y) && isfinite(e->pose.theta));
    must(e->confidence >= 0.0 && e->confidence <= 1.0);
    for (int i = 0; i < 9; i++)
        must(isfinite(e->covariance[i]));
    must(e->covariance[0] > 0.0 && e->covariance[4] > 0.0 && e->covariance[8] > 0.0);
}

/* Filters are dear to make: each gets a coarse room. */
static struct nav_filter *make(int number)
{
    struct nav_problem p = room();
    p.robot.normals = true;
    nav_settings_set(&p.settings, "grid.cell_m", 0.1);
    nav_settings_set(&p.settings, "grid.cell_deg", 45.0);
    nav_settings_set(&p.settings, "foveal.cells", 3.0);
    nav_settings_set(&p.settings, "particle.count", 50.0);
    return nav_filter_new(nav_filter_name(number), &p);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    int filters = 0;
    while (nav_filter_name(filters))
        filters++;
    if (size == 0)
        return 0;
    struct input in = {data + 1, data + size};
    struct nav_filter *f = make(data[0] % filters);
    while (f && in.at < in.end) {
        double texture[2], radial, normal[2];
        struct nav_row row = {.t_s = cell(&in), .texture = texture, .radial_m = &radial, .normal = normal};
        for (int i = 0; i < 3; i++)
            row.odometry[i] = cell(&in);
        texture[0] = cell(&in);
        texture[1] = cell(&in);
        radial = cell(&in);
        normal[0] = cell(&in);
        normal[1] = cell(&in);
        struct nav_estimate e;
        nav_filter_step(f, &row, &e);
        check(&e);
    }
    nav_filter_free(f);
    return 0;
}
