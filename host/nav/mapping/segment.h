/* Contacts in a row: a segment of one of the map's faces, or of a new one. */
#ifndef NAV_SEGMENT_H
#define NAV_SEGMENT_H

#include "faces.h"

/* Tells which face the loose contacts about this one are most likely of, where they lie in a row, or makes a face of
 * them. Returns the log-likelihood that this adds. */
double nav_segment_take(struct nav_faces *, struct nav_joint *, const struct nav_touches *, const struct nav_contact *);

#endif
