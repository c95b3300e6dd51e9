/*
 * Whether wheels can have done what was said of them: one rule for whatever reports a base's motion.
 *
 * What is faster than the wheels can drive was pushed; what is faster than anybody pushes was carried, or is wrong.
 */
#ifndef CREATE_JUDGE_H
#define CREATE_JUDGE_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* cffi: begin */
struct create_reach {
    double speed_m_s;    /* of a wheel, at most */
    double wheel_base_m; /* between the wheels */
};

enum create_verdict { CREATE_DRIVEN, CREATE_PUSHED, CREATE_CARRIED };

/* Of a motion in time_s by wheels the faster of which was asked for asked_m_s. */
enum create_verdict create_judge(const struct create_reach *reach, double distance, double angle, double asked_m_s,
                                 double time_s);

/* The way of the wheel that goes further, m. */
double create_wheel_way(const struct create_reach *reach, double distance, double angle);

/* The furthest that a wheel can drive, m. */
double create_driven_most(const struct create_reach *reach, double time_s);

/* Standard deviation of what a base without encoders was pushed while nobody heard it, m. */
double create_pushed_unseen(double time_s);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
