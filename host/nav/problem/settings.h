/* Every number of the filters that a user may change, by name: `section.key`. */
#ifndef NAV_SETTINGS_H
#define NAV_SETTINGS_H

/* cffi: begin */
struct nav_settings {
    double texture_temper;    /* exponent on a window's likelihood; 0: estimated from the windows (mm_texture.c) */
    double texture_outlier;   /* share of windows that say nothing about the tile (borders, catches) */
    double texture_spacing_m; /* a window counts in full after the tip has moved so far since the last one */
    double radial_miss;       /* share of contacts that are not noticed */
    double radial_ghost;      /* share of readings that report a contact with nothing */
    double radial_edge_m;     /* noticing a contact falls off over this distance around the whisker's length */
    double radial_spacing_m;  /* "no contact" counts in full after the whisker has moved so far since it last did */
    double trust_learn;    /* 1: whiskers that keep disagreeing with a sure belief count for less (trust.h); 0: never */
    double motion_along_m; /* the relative odometry error keeps its value over about this distance ... */
    double motion_turn_rad;   /* ... and this angle */
    double motion_drift_rad;  /* heading error of a straight metre, standard deviation */
    double motion_calibrate;  /* 1: learns constant errors of the odometry (calibration.h), where the filter can */
    double grid_cell_m;       /* edge of a cell of the grid */
    double grid_cell_deg;     /* its extent in heading; the number of slices is rounded */
    double grid_sub;          /* likelihood: sub-poses per cell edge, */
    double grid_sub_heading;  /* and per cell heading */
    double grid_teleport;     /* probability per reading that the robot has been put elsewhere */
    double foveal_cells;      /* per axis, odd (paper: 11) */
    double foveal_diameter_m; /* between the outermost cell centres (paper: 0.25) */
    double foveal_span_deg;   /* between the outermost headings (paper: -45 to 45) */
    double foveal_quantum_m;  /* quantisation term added to each posterior covariance, standard deviations */
    double foveal_quantum_deg;
    double foveal_printed;         /* 1: equation 7 as printed, without weights */
    double foveal_inflate;         /* 1: every posterior covariance is blown up to the fovea's (the paper's shortcut) */
    double particle_count;         /* how many; 0: as many as the belief's spread asks for (KLD), between */
    double particle_least;         /* this */
    double particle_most;          /* and this */
    double particle_error;         /* of that belief, Kullback-Leibler divergence exceeded once in a hundred rows, */
    double particle_bin_m;         /* in bins of this edge */
    double particle_bin_deg;       /* and this extent in heading */
    double particle_resample;      /* resamples when the effective share of the particles falls below this */
    double particle_recovery;      /* slow rate at which the mean weight is followed; 0: no recovery by injection */
    double particle_recovery_fast; /* fast rate */
    double adaptive_budget;        /* most cells and particles touched per row */
    double adaptive_detail_budget; /* the same where small tiles ask for cells below adaptive.cell_m; in large arenas,
                                      at most */
    double adaptive_most;          /* particles, at most */
    double adaptive_least;         /* and at least; between, by the bins they occupy: */
    double adaptive_per_bin;       /* so many in each */
    double adaptive_bin_m;         /* of this edge */
    double adaptive_bin_deg;       /* and this extent in heading */
    double adaptive_gain;          /* prior standard deviation of the odometry's gains */
    double adaptive_cell_m;        /* edge of the arena-wide histogram's finest cells; less on small tiles */
    double adaptive_cell_deg;      /* and their extent in heading */
    double adaptive_rows; /* it begins with at most so many budgets of cells, where these are not too wide for tiles */
    double adaptive_hazard;    /* probability at any row that the robot has been put elsewhere */
    double adaptive_wake;      /* odds of being elsewhere at which the histogram wakes */
    double adaptive_scattered; /* share of the histogram that a cloud may leave out */
    double multi_modes;        /* Gaussians, at most */
    double multi_points;       /* at which each is weighed */
    double multi_quantum_m;    /* added to each posterior: standard deviation, at the robot and at a whisker's tip */
    double multi_split;        /* a mode splits when two heaps explain this share of its longest axis's variance */
    double multi_merge;        /* modes merge when their means are so many standard deviations apart */
    double multi_prune;        /* share of weight at which a mode is dropped */
};

/* The defaults. */
void nav_settings_default(struct nav_settings *);

/* Sets one by name; returns 0, -1 for an unknown name, -2 when the value is outside the setting's range. */
int nav_settings_set(struct nav_settings *, const char *name, double value);

/* Name, default, lowest and highest value of setting number `index`; 0, or -1 beyond the last. */
int nav_settings_describe(int index, const char **name, double *standard, double *low, double *high);
/* cffi: end */

#endif
