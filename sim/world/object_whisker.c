#include "object_whisker.h"

#include <math.h>
#include <pthread.h>

#include "whisker_constants.h"

/* A face met at a glancing angle would turn any motion into an endless angle: its sine is not taken below this. */
#define LEAST_SINE 0.25

static const double SPREADS[] = SIM_WHISK_SPREADS;

/* The whisker's undeformed segment in the arena. */
struct segment {
    struct sim_point base, along; /* along: unit vector from base to tip */
};

static double object_whisker_dot(struct sim_point a, struct sim_point b)
{
    return a.x * b.x + a.y * b.y;
}

static struct sim_point object_whisker_left_of(struct sim_point a)
{
    return (struct sim_point){-a.y, a.x};
}

static struct sim_point object_whisker_difference(struct sim_point a, struct sim_point b)
{
    return (struct sim_point){a.x - b.x, a.y - b.y};
}

static struct segment object_whisker_place(const struct sim_whisker *mount, struct sim_pose pose)
{
    double c = cos(pose.theta), s = sin(pose.theta);
    double yaw = pose.theta + mount->yaw;
    return (struct segment){{pose.x + c * mount->x - s * mount->y, pose.y + s * mount->x + c * mount->y},
                            {cos(yaw), sin(yaw)}};
}

static struct sim_point object_whisker_point_at(struct segment segment, double radius)
{
    return (struct sim_point){segment.base.x + radius * segment.along.x, segment.base.y + radius * segment.along.y};
}

static const mech_table *shared_table;

static void object_whisker_make_table(void)
{
    shared_table = mech_table_new(); /* kept for the life of the process: every world reads it */
}

bool sim_object_whisker_start(struct sim_object_whisker *whisker, const struct sim_scene *scene, uint32_t lane,
                              size_t number, struct sim_rng rng, struct sim_rng surface)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, object_whisker_make_table);
    if (!shared_table)
        return false;
    size_t known = sizeof SPREADS / sizeof SPREADS[0];
    *whisker =
        (struct sim_object_whisker){.mount = scene->whisker[lane], .spread = SPREADS[number % known], .rng = rng};
    whisker->profile.rng = surface;
    struct mech_whisker made = mech_whisker_draw(scene->batch, lane);
    made.length = whisker->mount.length_m;
    mech_shaft_start(&whisker->shaft, &made, shared_table, (int)scene->mechanics, SIM_TICK_S);
    return true;
}

/* Has the shaft swept over this corner? Then radius is where along the shaft, side on which side the corner was. */
static bool object_whisker_swept(struct segment from, struct segment to, struct sim_point corner, double *radius,
                                 double *side)
{
    double before =
        object_whisker_dot(object_whisker_left_of(from.along), object_whisker_difference(corner, from.base));
    double after = object_whisker_dot(object_whisker_left_of(to.along), object_whisker_difference(corner, to.base));
    *radius = object_whisker_dot(to.along, object_whisker_difference(corner, to.base));
    *side = before < 0 ? -1 : 1;
    return (before < 0) != (after < 0) && *radius > 0;
}

/* The swept corner nearest to the base, if any within the whisker's length. */
static bool object_whisker_find_corner(struct sim_object_whisker *whisker, const struct sim_scene *scene,
                                       struct segment from, struct segment to)
{
    double nearest = whisker->mount.length_m;
    bool found = false;
    for (size_t i = 0; i < 4 * scene->obstacles; i++) {
        const struct sim_box *box = &scene->obstacle[i / 4];
        struct sim_point corner = {i & 1 ? box->x1 : box->x0, i & 2 ? box->y1 : box->y0};
        double radius, side;
        if (!object_whisker_swept(from, to, corner, &radius, &side) || radius > nearest)
            continue;
        nearest = radius;
        whisker->side = side;
        found = true;
    }
    whisker->contact.corner = found;
    whisker->contact.radius_m = nearest;
    return found;
}

static void object_whisker_meet_face(struct sim_object_whisker *whisker, const struct sim_hit *hit)
{
    whisker->normal = hit->normal;
    whisker->surface = hit->surface;
    if (!whisker->surface)
        return;
    mech_floor_start(&whisker->profile, whisker->surface, whisker->profile.rng);
    whisker->onset_height = mech_floor_height(&whisker->profile, whisker->surface);
}

static void object_whisker_begin(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct segment from,
                                 struct segment to, struct sim_hit shaft)
{
    whisker->contact.touching = true;
    whisker->contact.theta_rad = whisker->lift = 0;
    whisker->surface = NULL;
    whisker->contact.amplitude_gain = 1 + whisker->spread * sim_rng_normal(&whisker->rng);
    if (object_whisker_find_corner(whisker, scene, from, to))
        return;
    /* No corner: the tip has run into a face, the one that its path crossed. A whisker that touches from the start has
     * no path: then the face that the shaft enters. */
    struct sim_hit hit;
    double length = whisker->mount.length_m;
    if (!sim_arena_ray(scene, object_whisker_point_at(from, length), object_whisker_point_at(to, length), &hit) ||
        hit.fraction <= 0)
        hit = shaft;
    object_whisker_meet_face(whisker, &hit);
    whisker->side = object_whisker_dot(object_whisker_left_of(to.along), hit.normal) < 0 ? -1 : 1;
}

/* Angle by which a way of the material point, m along this direction, pushes the whisker further (positive) or lets it
 * come back; left: of the shaft. */
static double object_whisker_pushed(const struct sim_object_whisker *whisker, struct sim_point left, double way)
{
    double sine = whisker->contact.corner ? 1 : fabs(object_whisker_dot(left, whisker->normal));
    return way / fmax(sine, LEAST_SINE) / whisker->contact.radius_m;
}

/* Lets the tip slide along a face that has a texture: by the motion that does not bend the shaft by `angle`. */
static void object_whisker_slide(struct sim_object_whisker *whisker, struct sim_point left, struct sim_point motion,
                                 double angle)
{
    double bent = whisker->side * angle * whisker->contact.radius_m;
    mech_floor_move(&whisker->profile, whisker->surface, hypot(motion.x - bent * left.x, motion.y - bent * left.y));
    double height = mech_floor_height(&whisker->profile, whisker->surface) - whisker->onset_height;
    whisker->lift = object_whisker_pushed(whisker, left, height);
}

void sim_object_whisker_move(struct sim_object_whisker *whisker, const struct sim_scene *scene, struct sim_pose from,
                             struct sim_pose to)
{
    struct segment before = object_whisker_place(&whisker->mount, from),
                   now = object_whisker_place(&whisker->mount, to);
    struct sim_hit hit;
    if (!sim_arena_ray(scene, now.base, object_whisker_point_at(now, whisker->mount.length_m), &hit)) {
        whisker->contact = (struct sim_contact){0};
        return;
    }
    if (!whisker->contact.touching) {
        object_whisker_begin(whisker, scene, before, now, hit);
        return;
    }
    /* The normal halfway through the motion makes a motion and its reverse cancel exactly. */
    struct sim_point along = {before.along.x + now.along.x, before.along.y + now.along.y};
    double norm = hypot(along.x, along.y);
    struct sim_point left = object_whisker_left_of((struct sim_point){along.x / norm, along.y / norm});
    double radius = whisker->contact.radius_m;
    struct sim_point motion =
        object_whisker_difference(object_whisker_point_at(now, radius), object_whisker_point_at(before, radius));
    double way = whisker->contact.corner ? whisker->side * object_whisker_dot(motion, left)
                                         : object_whisker_dot(motion, whisker->normal);
    double angle = object_whisker_pushed(whisker, left, way);
    if (whisker->surface)
        object_whisker_slide(whisker, left, motion, angle);
    whisker->contact.theta_rad = whisker->side * fmax(0, whisker->side * whisker->contact.theta_rad + angle);
}

void sim_object_whisker_bend(struct sim_object_whisker *whisker, double turn_rate)
{
    const struct sim_contact *contact = &whisker->contact;
    double theta = contact->theta_rad;
    if (whisker->surface)
        theta = whisker->side * fmax(0, whisker->side * theta + whisker->lift);
    struct mech_touch touch = {contact->touching, contact->radius_m, contact->amplitude_gain * theta, turn_rate,
                               !contact->corner};
    mech_shaft_step(&whisker->shaft, &touch);
}

double sim_object_whisker_reach(const struct sim_whisker *mount)
{
    double x = mount->x + mount->length_m * cos(mount->yaw);
    double y = mount->y + mount->length_m * sin(mount->yaw);
    return fmax(hypot(mount->x, mount->y), hypot(x, y));
}
