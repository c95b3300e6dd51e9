/* Cubic Lagrange interpolation in a table with equally spaced nodes: the four weights about a position, and their
 * derivatives by it. */
#ifndef NAV_CUBIC_H
#define NAV_CUBIC_H

struct nav_cubic {
    int first; /* of the four nodes */
    double weight[4], slope[4];
};

/* position: in steps from node 0; beyond the nodes (at least four) the outermost four extrapolate. */
static inline struct nav_cubic nav_cubic_at(double position, int nodes)
{
    int before = (int)position - 1, first = before < 0 ? 0 : before > nodes - 4 ? nodes - 4 : before;
    double t = position - first, a = t - 1, b = t - 2, d = t - 3;
    return (struct nav_cubic){first,
                              {-a * b * d / 6, t * b * d / 2, -t * a * d / 2, t * a * b / 6},
                              {-(b * d + a * d + a * b) / 6, (b * d + t * d + t * b) / 2, -(a * d + t * d + t * a) / 2,
                               (a * b + t * b + t * a) / 6}};
}

#endif
