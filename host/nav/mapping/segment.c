#include "segment.h"

#include <math.h>

static const double FACING = 0.7;       /* cosine between the normals of a face and a segment of it */
static const double SEGMENT_HITS = 4.0; /* contacts that a segment counts for, at most */

/* A segment as one of a face: how far its middle is off, how far it is turned. */
struct segment_match {
    double off, turn, along;
    struct nav_linear place, angle;
    double likelihood; /* 1 / (m rad) */
};

/* Choices: the faces of the map, then a new one at right angles, then any other new one. */
struct segment_choice {
    struct segment_match match[NAV_FACES_MOST + 1];
    double likelihood[NAV_FACES_MOST + 2];
    double total;
};

static void segment_match_face(const struct nav_face *g, const struct nav_joint *j, const struct nav_touches_line *line,
                               struct segment_match *m)
{
    struct nav_touch middle = {
        .x = line->x, .y = line->y, .along_x = -cos(line->normal), .along_y = -sin(line->normal)};
    struct nav_face_view v;
    m->likelihood = 0.0;
    if (!nav_face_look(g, j, &middle, &v) || v.facing < FACING)
        return;
    m->angle.terms = 0;
    nav_linear_add(&m->angle, NAV_JOINT_HEADING, 1.0);
    nav_linear_add(&m->angle, g->index, -1.0);
    m->turn = nav_wrap(j->mean[NAV_JOINT_HEADING] + line->normal - j->mean[g->index]);
    m->place = v.form;
    m->off = v.off;
    m->along = v.along;
    struct nav_linear both = nav_linear_sum(&m->angle, &v.form);
    double turned = nav_joint_variance(j, &m->angle), angle_var = turned + line->normal_var;
    double cross = 0.5 * (nav_joint_variance(j, &both) - turned - v.variance);
    /* The offset given the turn. */
    double off = v.off - cross / angle_var * m->turn;
    double left = v.variance + line->offset_var + NAV_FACE_ROUGH_M * NAV_FACE_ROUGH_M - cross * cross / angle_var;
    double beyond = fmax(nav_face_beyond(g, v.along) - line->span / 2.0, 0.0);
    if (m->turn * m->turn / angle_var + off * off / left < NAV_FACE_GATE)
        m->likelihood = nav_face_normal_density(m->turn, angle_var) * nav_face_normal_density(off, left) *
                        exp(-beyond * nav_face_decay(g));
}

/* Off from the axes, where these are known, by a turn of less than half a right angle. */
static double segment_off_axes(double turn, double variance)
{
    double right = NAV_PI / 2.0;
    return variance < NAV_JOINT_AXES_KNOWN ? turn - right * round(turn / right) : turn;
}

static void segment_match_axes(const struct nav_joint *j, const struct nav_touches_line *line, struct segment_match *m)
{
    m->angle.terms = 0;
    nav_linear_add(&m->angle, NAV_JOINT_HEADING, 1.0);
    nav_linear_add(&m->angle, NAV_JOINT_AXES, -1.0);
    double variance = nav_joint_variance(j, &m->angle);
    double turn = j->mean[NAV_JOINT_HEADING] + line->normal - j->mean[NAV_JOINT_AXES];
    m->turn = segment_off_axes(turn, variance);
    variance += line->normal_var + NAV_FACE_RIGHT_RAD * NAV_FACE_RIGHT_RAD;
    m->likelihood = variance > NAV_JOINT_AXES_KNOWN ? 2.0 / NAV_PI : nav_face_normal_density(m->turn, variance) / 4.0;
}

static void segment_weigh(const struct nav_faces *f, const struct nav_joint *j, const struct nav_touches_line *line,
                          double fresh, struct segment_choice *c)
{
    int count = f->count;
    double right = f->right / (f->right + f->refused);
    for (int n = 0; n < count; n++) {
        segment_match_face(&f->face[n], j, line, &c->match[n]);
        c->likelihood[n] = c->match[n].likelihood;
    }
    segment_match_axes(j, line, &c->match[count]);
    c->likelihood[count] = fresh * right * c->match[count].likelihood;
    c->likelihood[count + 1] = fresh * (1.0 - right) / (2.0 * NAV_PI);
    c->total = 0.0;
    for (int n = 0; n < count + 2; n++)
        c->total += c->likelihood[n];
}

static int segment_choose(const struct segment_choice *c, int count)
{
    int best = 0;
    for (int n = 1; n < count; n++)
        best = c->likelihood[n] > c->likelihood[best] ? n : best;
    return best;
}

static double segment_hits(const struct nav_touches_line *line)
{
    return fmin(nav_touches_count(line->used), SEGMENT_HITS);
}

static void segment_of_face(struct nav_face *g, struct nav_joint *j, const struct nav_touches_line *line,
                            const struct segment_match *m)
{
    nav_joint_measure(j, &m->place, -m->off, line->offset_var + NAV_FACE_ROUGH_M * NAV_FACE_ROUGH_M);
    double turn = nav_wrap(j->mean[NAV_JOINT_HEADING] + line->normal - j->mean[g->index]);
    nav_joint_measure(j, &m->angle, -turn, line->normal_var);
    nav_face_feel(g, m->along - line->span / 2.0, m->along + line->span / 2.0);
    g->hits += segment_hits(line);
}

static void segment_to_axes(const struct nav_face *g, struct nav_joint *j)
{
    struct nav_linear angle = {.terms = 0};
    nav_linear_add(&angle, g->index, 1.0);
    nav_linear_add(&angle, NAV_JOINT_AXES, -1.0);
    double turn = segment_off_axes(j->mean[g->index] - j->mean[NAV_JOINT_AXES], nav_joint_variance(j, &angle));
    nav_joint_measure(j, &angle, -turn, NAV_FACE_RIGHT_RAD * NAV_FACE_RIGHT_RAD);
}

static void segment_add(struct nav_faces *f, struct nav_joint *j, const struct nav_touches_line *line, bool right)
{
    const double *m = j->mean;
    double c = cos(m[NAV_JOINT_HEADING]), s = sin(m[NAV_JOINT_HEADING]);
    double lx = c * line->x - s * line->y, ly = s * line->x + c * line->y;
    double normal = m[NAV_JOINT_HEADING] + line->normal, nx = cos(normal), ny = sin(normal);
    struct nav_linear direction = {.terms = 0}, offset = {.terms = 0};
    nav_linear_add(&direction, NAV_JOINT_HEADING, 1.0);
    nav_linear_add(&offset, NAV_JOINT_X, nx);
    nav_linear_add(&offset, NAV_JOINT_Y, ny);
    nav_linear_add(&offset, NAV_JOINT_HEADING, ny * lx - nx * ly);
    struct nav_face *g = &f->face[f->count++];
    *g = (struct nav_face){.anchor_x = m[NAV_JOINT_X] + lx, .anchor_y = m[NAV_JOINT_Y] + ly, .right = right};
    g->hits = segment_hits(line);
    g->index = nav_joint_add(j, normal, &direction, line->normal_var);
    (void)nav_joint_add(j, 0.0, &offset, line->offset_var + NAV_FACE_ROUGH_M * NAV_FACE_ROUGH_M);
    nav_face_feel(g, -line->span / 2.0, line->span / 2.0);
    *(right ? &f->right : &f->refused) += 1.0;
    if (right)
        segment_to_axes(g, j);
}

/* Log-likelihood of the segment's contacts, over all of them as of no face. Two of them fix the line, or one and its
 * normal. */
static double segment_score(const struct nav_touches_line *line, double total, double length)
{
    double contacts = nav_touches_count(line->used), each = length / sqrt(2.0 * NAV_PI * line->offset_var * contacts);
    double fixed = contacts > 1.0 ? length * length / line->span : 2.0 * NAV_PI * length;
    return log(total * fixed) + fmax(contacts - 2.0, 0.0) * log(each) - contacts * log(NAV_FACES_LOOSE);
}

/* The line is one of many that might have been found: it must be worth the choice of two contacts. A single contact and
 * its normal were not chosen. */
static double segment_place(struct nav_faces *f, struct nav_joint *j, const struct nav_touches *touches,
                            const struct nav_touches_line *line, const struct nav_contact *contact)
{
    struct segment_choice choice;
    int count = f->count;
    bool single = nav_touches_count(line->used) == 1;
    segment_weigh(f, j, line, single ? nav_faces_fresh(contact) : NAV_FACE_NEW_PER_M, &choice);
    double score = segment_score(line, choice.total, contact->length);
    if (score < (single ? 0.0 : 2.0 * log(nav_touches_count(f->loose))))
        return 0.0;
    int chosen = segment_choose(&choice, count + 2);
    if (!single && chosen >= count && nav_faces_apart(f, j, touches, line->used, contact) > score)
        return nav_faces_drain(f, j, touches, line->used, contact, true);
    f->loose &= ~line->used;
    if (chosen < count)
        segment_of_face(&f->face[chosen], j, line, &choice.match[chosen]);
    else if (count < NAV_FACES_MOST)
        segment_add(f, j, line, chosen == count);
    return score;
}

double nav_segment_take(struct nav_faces *f, struct nav_joint *j, const struct nav_touches *touches,
                        const struct nav_contact *contact)
{
    struct nav_touches_line line;
    f->loose &= touches->held;
    if (!(f->loose >> contact->place & 1) || !nav_touches_fit(touches, contact->place, f->loose, &line))
        return 0.0;
    double sum = segment_place(f, j, touches, &line, contact);
    sum += nav_faces_drain(f, j, touches, ~0ULL, contact, false);
    nav_faces_review(f, j);
    return sum;
}
