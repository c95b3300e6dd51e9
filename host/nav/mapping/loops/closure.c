#include "closure.h"

#include <math.h>

static const double CONFIRMED = 5.0; /* contacts */
/* Further contacts lie in a line with the first. That tells the direction of a face, which with right angles is one of
 * four, and nothing else: their places follow from the first one's whatever face it is of. */
static const double DIRECTIONS = 4.0;

void nav_stretch_begin(struct nav_stretch *s, struct nav_sighting now, double contacts)
{
    *s = (struct nav_stretch){.then = now, .last = now, .contacts = contacts};
}

double nav_closure_doubt(double before, double nats)
{
    double odds = before / (1.0 - before) * exp(-nats);
    return before < 1.0 ? odds / (1.0 + odds) : 1.0;
}

void nav_stretch_feel(struct nav_stretch *s, struct nav_sighting now, double known, double probability, double contacts)
{
    if (now.way - s->last.way > NAV_CLOSURE_AWAY_M) {
        *s = (struct nav_stretch){.then = s->last,
                                  .known = known,
                                  .doubt = 1.0 - probability,
                                  .more = contacts > 1.0 ? 0.0 : log(DIRECTIONS),
                                  .open = known > NAV_CLOSURE_GROWN_M};
    } else {
        double nats = fmin(-log(fmax(1.0 - probability, 1e-12)), s->more);
        s->doubt = nav_closure_doubt(s->doubt, nats);
        s->more -= nats;
    }
    s->last = now;
    s->contacts += contacts;
}

bool nav_stretch_confirmed(const struct nav_stretch *s)
{
    return s->contacts >= CONFIRMED;
}
