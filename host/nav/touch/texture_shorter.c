#include "texture_shorter.h"

#include <math.h>
#include <stdlib.h>

#include "texture_bands.h"

struct nav_texture_shorter {
    int length, stretch, stretches;
    double *centred; /* [stretch] */
    double *row;     /* [stretches][bands' count] */
    struct nav_texture_bands *bands;
};

struct nav_texture_shorter *nav_texture_shorter_new(int length, int parts)
{
    struct nav_texture_shorter *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    *s = (struct nav_texture_shorter){.length = length, .stretch = length / parts, .stretches = 2 * parts - 1};
    s->bands = nav_texture_bands_new(s->stretch);
    s->centred = calloc((size_t)s->stretch, sizeof *s->centred);
    if (s->bands)
        s->row = calloc((size_t)s->stretches * (size_t)nav_texture_bands_count(s->bands), sizeof *s->row);
    if (!s->centred || !s->row) {
        nav_texture_shorter_free(s);
        return NULL;
    }
    return s;
}

void nav_texture_shorter_free(struct nav_texture_shorter *s)
{
    if (!s)
        return;
    free(s->centred);
    free(s->row);
    nav_texture_bands_free(s->bands);
    free(s);
}

int nav_texture_shorter_count(const struct nav_texture_shorter *s)
{
    return 2 * nav_texture_bands_count(s->bands);
}

/* Mean of a column over all stretches, and its standard deviation. */
static void mean_and_spread(const struct nav_texture_shorter *s, int column, int count, double *mean, double *spread)
{
    double sum = 0.0, squares = 0.0;
    for (int i = 0; i < s->stretches; i++)
        sum += s->row[i * count + column];
    *mean = sum / s->stretches;
    for (int i = 0; i < s->stretches; i++) {
        double apart = s->row[i * count + column] - *mean;
        squares += apart * apart;
    }
    *spread = sqrt(squares / s->stretches);
}

double *nav_texture_shorter_work(struct nav_texture_shorter *s, const double *x, double floor, double *out)
{
    int count = nav_texture_bands_count(s->bands);
    double *row = s->row, squares;
    for (int i = 0; i < s->stretches; i++) {
        long start = (long)(s->length - s->stretch) * i / (s->stretches - 1);
        nav_texture_centre(x + start, 1, s->stretch, s->centred, &squares);
        row = nav_texture_bands_work(s->bands, s->centred, squares, floor, row);
    }
    for (int c = 0; c < count; c++)
        mean_and_spread(s, c, count, out + c, out + count + c);
    return out + 2 * count;
}
