/*
 * Whether a Create 1 keeps or drops what is less than a unit, from every settled frame of straight drives and turns.
 *
 * Wheels that were asked for x units a frame turn by x within SPREAD. A firmware that keeps remainders then reports one
 * of the two whole numbers about that, each as often as its distance from the other; one that drops them reports the
 * lower one, always. Each way is tested by Page's test (Biometrika 41, 1954): the sum of log(chance on average if the
 * other way counts / greatest chance if this way counts), never below 0; the greatest over all motions within SPREAD,
 * so that no wheel error speaks against a way that is in use. The chance that such a sum reaches S within n frames
 * is below n exp(-S): S = FIRST for the first verdict, REVISED to change it. A body that stands gives no evidence, and
 * too little is never evidence that remainders are dropped. Nor is a number that comes again and again evidence that
 * they are kept: a body that is pushed with a steady hand has one where they are dropped, and what is kept shows by
 * numbers that go up and down. The sums outlast interruptions, and go on: another base is noticed.
 */
#include <math.h>

#include "odometry.h"

/* Chance of a number that neither way reports: an uneven period, damage that the sum of a frame does not show. */
#define STRAY 0.01
#define FIRST 12
#define REVISED 20
/* Wheels reach a new speed within 150 ms (assumed). */
#define SETTLED_FRAMES 10
#define POINTS 5 /* motions within SPREAD that an average is taken over */

/* The chances of one reported number: on average, and at best, over the motions that are possible. */
struct chances {
    double average, best;
};

static struct chances remainder_if_kept(double least, double most, double reported)
{
    const double away = fmax(0, fmax(reported - most, least - reported));
    double sum = 0;
    for (int i = 0; i < POINTS; i++) {
        sum += fmax(0, 1 - fabs(reported - (least + (most - least) * i / (POINTS - 1))));
    }
    return (struct chances){fmax(STRAY, sum / POINTS), fmax(STRAY, 1 - away)};
}

static struct chances remainder_if_dropped(double least, double most, double reported)
{
    int equal = 0;
    for (int i = 0; i < POINTS; i++) {
        equal += fabs(floor(least + (most - least) * i / (POINTS - 1)) - reported) < 0.5;
    }
    const bool possible = reported >= floor(least) && reported <= floor(most);
    return (struct chances){fmax(STRAY, (double)equal / POINTS), possible ? 1 : STRAY};
}

/* A number reported for a motion that was asked for, both in units and in the direction of that motion; again: the
 * frame before reported it, too. What neither way reports, as of a body that stands or is held back, weighs nothing.
 * Nor does 0 against kept remainders where dropped ones would report it: a body that stands reports it, too. */
static void remainder_weigh(struct create_evidence *evidence, double asked, double reported, bool again)
{
    const double least = asked * (1 - ODOMETRY_SPREAD), most = asked * (1 + ODOMETRY_SPREAD);
    const struct chances kept = remainder_if_kept(least, most, reported),
                         dropped = remainder_if_dropped(least, most, reported);
    if (reported > 0) {
        evidence->against_kept = fmax(0, evidence->against_kept + log(dropped.average / kept.best));
    }
    evidence->against_dropped = fmax(0, evidence->against_dropped + log(kept.average / (again ? 1 : dropped.best)));
}

static void remainder_weigh_part(struct create_evidence *evidence, double asked, int32_t reported, int32_t before)
{
    if (asked != 0) {
        remainder_weigh(evidence, fabs(asked), asked > 0 ? reported : -reported, reported == before);
    }
}

/* Frames since the wheels were asked for other speeds, or a frame was missed. */
static uint32_t remainder_settle(struct create_evidence *evidence, const struct create_frame *frame)
{
    const int32_t left = frame->value[CREATE_OI_REQUESTED_LEFT], right = frame->value[CREATE_OI_REQUESTED_RIGHT];
    const bool same = frame->missed == 0 && left == evidence->left && right == evidence->right;
    evidence->settled = same ? evidence->settled + 1 : 0;
    evidence->left = left;
    evidence->right = right;
    return evidence->settled;
}

static void remainder_decide(struct create_odometry *odometry)
{
    struct create_evidence *evidence = &odometry->evidence;
    const double enough = odometry->remainder == CREATE_UNKNOWN ? FIRST : REVISED;
    if (evidence->against_kept >= enough || evidence->against_dropped >= enough) {
        odometry->remainder = evidence->against_kept > evidence->against_dropped ? CREATE_DROPPED : CREATE_KEPT;
        evidence->against_kept = evidence->against_dropped = 0;
    }
}

void remainder_watch(struct create_odometry *odometry, const struct create_frame *frame, struct odometry_units asked)
{
    struct create_evidence *evidence = &odometry->evidence;
    const int32_t distance = frame->value[CREATE_OI_DISTANCE], angle = frame->value[CREATE_OI_ANGLE];
    if (remainder_settle(evidence, frame) >= SETTLED_FRAMES && frame->value[CREATE_OI_BUMPS_DROPS] == 0) {
        remainder_weigh_part(evidence, asked.distance, distance, evidence->distance);
        remainder_weigh_part(evidence, asked.angle, angle, evidence->angle);
        remainder_decide(odometry);
    }
    evidence->distance = distance;
    evidence->angle = angle;
}
