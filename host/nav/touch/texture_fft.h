/* Power spectra of short real windows: a radix-2 transform with its tables made once. */
#ifndef NAV_TEXTURE_FFT_H
#define NAV_TEXTURE_FFT_H

struct nav_fft;

/* size: a power of two from 4 to 65536. NULL for any other size or without memory. */
struct nav_fft *nav_fft_new(int size);
void nav_fft_free(struct nav_fft *);

/* power[k] = |sum_i x[i] exp(-2 pi j k i / size)|^2 for k = 0 .. size/2; x[n] is padded with zeros, 0 <= n <= size. */
void nav_fft_power(struct nav_fft *, const double *x, int n, double *power);

#endif
