/* Which surface the whisker is on: a forward filter over windows in a row.
 *
 * Between windows the surface changes with some chance, to each other class alike; a window's evidence then weighs the
 * classes. Windows of one drive err alike, so their evidence counts by a factor fitted to drives held out.
 */
#ifndef NAV_TEXTURE_FILTER_H
#define NAV_TEXTURE_FILTER_H

#include <stddef.h>

/* posterior[classes]: all classes alike, as before any window. */
void nav_texture_filter_start(double *posterior, int classes);

/* The surface has changed with this chance, 0 to 1. */
void nav_texture_filter_change(double *posterior, int classes, double chance);

/* Weighs the classes by loglik[classes], whose largest is 0, times `temper`, >= 0. */
void nav_texture_filter_weigh(double *posterior, int classes, const double *loglik, double temper);

/* cffi: begin */
/* The posteriors[rows][classes] after each of so many windows of loglik[rows][classes], each after a change of surface
 * with this chance, from all classes alike. */
void nav_texture_filter_run(const double *loglik, size_t rows, int classes, double temper, double chance,
                            double *posterior);
/* cffi: end */

#endif
