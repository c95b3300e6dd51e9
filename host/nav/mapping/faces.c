#include "faces.h"

#include <math.h>

static const double NEW_SHARE = 0.1;                   /* of contacts that meet a face not in the map */
static const double SHARP_M = 0.02;                    /* a contact is surely of a face known so well ... */
static const double CLEAR = 5.0;                       /* ... that explains it so much better than a new one */
static const double NORMAL_GATE = 9.0;                 /* squared standard deviations */
static const double PASSED = 0.95;                     /* probability that a whisker went through a face */
static const double GONE = 3.0, GONE_SHARE = 0.5;      /* passages that remove a face, beside so many of its contacts */
static const double HITS_MOST = 20.0;                  /* contacts that count against passages */
static const double THROUGH = 0.5;                     /* a row in which the body stands in a face, without it */
static const double CORNER_M = 0.03, PLACE_MOST = 0.3; /* m from a face's end; m of the pose: no passage is counted */

void nav_faces_begin(struct nav_faces *f)
{
    f->count = 0;
    f->loose = 0;
    f->right = 1.0;
    f->refused = 1.0;
}

double nav_faces_fresh(const struct nav_contact *c)
{
    return (NEW_SHARE + c->ghost) / c->length;
}

/* The face that a contact is most likely of; -1: none known to `sharp` m explains it. *total: its likelihood, 1 / m. */
static int faces_choose(const struct nav_faces *f, const struct nav_joint *j, const struct nav_touch *t, double sigma,
                        double fresh, double sharp, double *total)
{
    struct nav_face_view view;
    double best = 0.0, all = 0.0;
    int chosen = -1;
    for (int n = 0; n < f->count; n++) {
        if (!nav_face_look(&f->face[n], j, t, &view))
            continue;
        double likelihood = nav_face_likelihood(&f->face[n], &view, nav_face_noise(&view, sigma));
        all += likelihood;
        if (likelihood > best) {
            best = likelihood;
            chosen = view.variance < sharp * sharp ? n : -1;
        }
    }
    *total = all + fresh;
    return all > CLEAR * fresh ? chosen : -1;
}

/* The direction of the normal, where the whisker reports it. */
static void faces_apply_normal(struct nav_face *g, struct nav_joint *j, const struct nav_touch *t)
{
    struct nav_linear form = {.terms = 0};
    if (isnan(t->normal))
        return;
    nav_linear_add(&form, NAV_JOINT_HEADING, 1.0);
    nav_linear_add(&form, g->index, -1.0);
    double off = nav_wrap(j->mean[NAV_JOINT_HEADING] + t->normal - j->mean[g->index]);
    double noise = t->normal_var + t->turned;
    if (off * off < NORMAL_GATE * (nav_joint_variance(j, &form) + noise))
        nav_joint_measure(j, &form, -off, noise);
}

static void faces_apply(struct nav_face *g, struct nav_joint *j, const struct nav_touch *t, double sigma)
{
    struct nav_face_view view;
    if (!nav_face_look(g, j, t, &view))
        return;
    nav_joint_measure(j, &view.form, -view.off, nav_face_noise(&view, sigma));
    faces_apply_normal(g, j, t);
    nav_face_feel(g, view.along, view.along);
    g->hits += 1.0;
    g->missed = fmax(g->missed - 1.0, 0.0);
}

double nav_faces_take(struct nav_faces *f, struct nav_joint *j, const struct nav_touches *touches,
                      const struct nav_contact *contact)
{
    const struct nav_touch *t = &touches->touch[contact->place];
    double total;
    f->loose &= ~(1ULL << contact->place);
    int chosen = faces_choose(f, j, t, contact->sigma, nav_faces_fresh(contact), SHARP_M, &total);
    if (chosen >= 0) {
        faces_apply(&f->face[chosen], j, t, contact->sigma);
        return log(total * contact->length);
    }
    f->loose |= 1ULL << contact->place;
    return log(NAV_FACES_LOOSE);
}

/* How far from the ends of a face the pose's uncertainty leaves it in doubt whether the face is there, m. */
static double faces_margin(const struct nav_joint *j)
{
    return CORNER_M + 2.0 * sqrt(j->cov[NAV_JOINT_X] + j->cov[NAV_JOINT_Y * (j->room + 1)]);
}

double nav_faces_miss(struct nav_faces *f, struct nav_joint *j, const struct nav_touch *end, double length, double edge,
                      double miss)
{
    struct nav_face_view v;
    double sum = 0.0, margin = faces_margin(j);
    for (int n = 0; n < f->count && margin < PLACE_MOST; n++) {
        struct nav_face *g = &f->face[n];
        if (!nav_face_look(g, j, end, &v) || v.off < -length * v.facing)
            continue;
        double z = v.off / sqrt(v.variance + edge * edge), where = v.along + fmin(v.off, 0.0) / v.facing * v.slant;
        if (z > 3.0 || !nav_face_felt(g, where, margin))
            continue;
        double beyond = 0.5 * erfc(z / sqrt(2.0));
        g->missed += beyond > PASSED;
        sum += log(1.0 - beyond + miss * beyond);
    }
    return sum;
}

double nav_faces_apart(const struct nav_faces *f, const struct nav_joint *j, const struct nav_touches *touches,
                       uint64_t among, const struct nav_contact *contact)
{
    double fresh = nav_faces_fresh(contact), total, sum = 0.0;
    for (int place = 0; place < NAV_TOUCHES_MOST; place++) {
        if (!(among >> place & 1))
            continue;
        const struct nav_touch *t = &touches->touch[place];
        (void)faces_choose(f, j, t, sqrt(t->variance), fresh, INFINITY, &total);
        sum += log(fmax((total - fresh) * contact->length / NAV_FACES_LOOSE, 1.0));
    }
    return sum;
}

double nav_faces_drain(struct nav_faces *f, struct nav_joint *j, const struct nav_touches *touches, uint64_t among,
                       const struct nav_contact *contact, bool all)
{
    double total, sum = 0.0;
    for (int place = 0; place < NAV_TOUCHES_MOST; place++) {
        const struct nav_touch *t = &touches->touch[place];
        if (!(f->loose & among & touches->held & 1ULL << place))
            continue;
        double sigma = sqrt(t->variance);
        int chosen = faces_choose(f, j, t, sigma, nav_faces_fresh(contact), all ? (double)INFINITY : SHARP_M, &total);
        if (chosen < 0)
            continue;
        faces_apply(&f->face[chosen], j, t, sigma);
        f->loose &= ~(1ULL << place);
        sum += log(total * contact->length / NAV_FACES_LOOSE);
    }
    return sum;
}

static void faces_drop(struct nav_faces *f, struct nav_joint *j, int face)
{
    nav_joint_remove(j, f->face[face].index, 2);
    for (int n = face; n + 1 < f->count; n++) {
        f->face[n] = f->face[n + 1];
        f->face[n].index -= 2;
    }
    f->count--;
}

/* Whether an older face has taken this one up. */
static bool faces_joined(struct nav_faces *f, struct nav_joint *j, int younger)
{
    for (int n = 0; n < younger; n++) {
        if (nav_face_join(&f->face[n], &f->face[younger], j))
            return true;
    }
    return false;
}

static bool faces_gone(const struct nav_face *g)
{
    return g->missed > GONE + GONE_SHARE * fmin(g->hits, HITS_MOST);
}

double nav_faces_stand(struct nav_faces *f, struct nav_joint *j, double radius)
{
    double sum = 0.0;
    double margin = faces_margin(j), x = j->mean[NAV_JOINT_X], y = j->mean[NAV_JOINT_Y];
    for (int n = f->count - 1; n >= 0; n--) {
        struct nav_face *g = &f->face[n];
        double nx = cos(j->mean[g->index]), ny = sin(j->mean[g->index]), dx = x - g->anchor_x, dy = y - g->anchor_y;
        double off = nx * dx + ny * dy - j->mean[g->index + 1];
        bool through = fabs(off) < radius - margin && nav_face_felt(g, nx * dy - ny * dx, 0.0);
        g->missed += through;
        sum += through ? log(THROUGH) : 0.0;
        if (through && faces_gone(g))
            faces_drop(f, j, n);
    }
    return sum;
}

void nav_faces_review(struct nav_faces *f, struct nav_joint *j)
{
    for (int n = f->count - 1; n >= 0; n--) {
        if (faces_gone(&f->face[n]) || faces_joined(f, j, n))
            faces_drop(f, j, n);
    }
}
