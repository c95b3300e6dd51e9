/* What every test here includes: cmocka in the order it asks for, and equality of doubles (its 1.1.5 has only floats).
 */
#ifndef NAV_TESTS_NEAR_H
#define NAV_TESTS_NEAR_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

static inline void assert_near_at(double a, double b, double tolerance, const char *file, int line)
{
    if (fabs(a - b) <= tolerance)
        return;
    print_error("%.12g is not %.12g +- %g\n", a, b, tolerance);
    _fail(file, line);
}

#define assert_near(a, b, tolerance) assert_near_at((a), (b), (tolerance), __FILE__, __LINE__)

#endif
