/* A measurement of one's own in C: ranges to UWB anchors in two corners of a room find a robot that has nothing else.
 *
 * The robot drives a circle and begins with a place known to 30 cm. Prints where the grid filter puts it at the end;
 * exits 1 when that is further than 10 cm from the truth. */
#include <math.h>
#include <stdio.h>

#include "filter.h"

enum { CODES = 80, ROWS = 120 };
static const double STEP_M = 0.05; /* of distance from one code to the next */

struct anchor {
    double x, y, sigma_m;
};

/* The distance that a range should report at a pose, as a code. */
static int uwb_range_anchor_expect(const void *self, double x, double y, double theta)
{
    const struct anchor *anchor = self;
    (void)theta; /* the antenna is over the robot's centre */
    return (int)(hypot(x - anchor->x, y - anchor->y) / STEP_M);
}

/* Likelihood of a range by code: a normal distribution about the middle of the code's distances. */
static void uwb_range_anchor_fill(const void *self, const double *reading, double *likelihood)
{
    const struct anchor *anchor = self;
    for (int code = 0; code < CODES; code++) {
        double off = (*reading - (code + 0.5) * STEP_M) / anchor->sigma_m;
        likelihood[code] = exp(-0.5 * off * off);
    }
}

int main(void)
{
    static const uint8_t floor[] = {0};
    static const struct anchor anchor[] = {{0.0, 0.0, 0.1}, {2.0, 0.0, 0.1}};
    const struct nav_sensor range[] = {{.values = 1,
                                        .codes = CODES,
                                        .expect = uwb_range_anchor_expect,
                                        .fill = uwb_range_anchor_fill,
                                        .self = &anchor[0]},
                                       {.values = 1,
                                        .codes = CODES,
                                        .expect = uwb_range_anchor_expect,
                                        .fill = uwb_range_anchor_fill,
                                        .self = &anchor[1]}};
    struct nav_problem problem = {
        .arena = {.size_x = 2.0, .size_y = 2.0, .tile = 2.0, .columns = 1, .rows = 1, .floor = floor, .classes = 1},
        .robot = {.body_radius = 0.1, .odometry_relative = 0.05, .radial_sigma = 0.005, .sensors = 2, .sensor = range},
        .prior = {.mean = {1.3, 0.5, 0.06}, .sigma = {0.3, 0.3, 0.1}}};
    nav_settings_default(&problem.settings);
    struct nav_filter *filter = nav_filter_new("grid", &problem);
    struct nav_estimate found = {.confidence = 0.0};
    double x = 1.0, y = 0.5, heading = 0.0;
    if (!filter) {
        fprintf(stderr, "uwb_range: no memory\n");
        return 1;
    }
    for (int k = 1; k <= ROWS; k++) {
        x += 0.03 * cos(heading);
        y += 0.03 * sin(heading);
        heading += 0.06;
        double reported[2];
        for (int n = 0; n < 2; n++) /* the sine stands for noise that is the same every time */
            reported[n] = hypot(x - anchor[n].x, y - anchor[n].y) + 0.1 * sin((12.9898 + n) * k * k);
        const struct nav_row row = {.t_s = 0.1 * k, .odometry = {0.03, 0.0, 0.06}, .own = reported};
        nav_filter_step(filter, &row, &found);
    }
    nav_filter_free(filter);
    printf("at (%.2f, %.2f), found at (%.2f, %.2f), confidence %.2f\n", x, y, found.pose.x, found.pose.y,
           found.confidence);
    return hypot(found.pose.x - x, found.pose.y - y) < 0.1 ? 0 : 1;
}
