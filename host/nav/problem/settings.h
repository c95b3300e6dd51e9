/* Every number of the filters that a user may change, by name: `section.key`. */
#ifndef NAV_SETTINGS_H
#define NAV_SETTINGS_H

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

enum { NAV_SUB_MOST = 16 }; /* sub-poses of a cell per axis */

/* cffi: begin */
struct nav_texture_settings {
    double temper;    /* exponent on a window's likelihood; 0: estimated from the windows (texture_model.c) */
    double outlier;   /* share of windows that say nothing about the tile (borders, catches) */
    double spacing_m; /* a window counts in full after the tip has moved so far since the last one */
};

struct nav_radial_settings {
    double miss;      /* share of contacts that are not noticed */
    double ghost;     /* share of readings that report a contact with nothing */
    double edge_m;    /* noticing a contact falls off over this distance around the whisker's length */
    double spacing_m; /* "no contact" counts in full after the whisker has moved so far since it last did */
};

struct nav_normal_settings {
    double outlier; /* share of directions of surfaces that say nothing about the face */
};

struct nav_motion_settings {
    double along_m;   /* the relative odometry error keeps its value over about this distance ... */
    double turn_rad;  /* ... and this angle */
    double drift_rad; /* heading error of a straight metre, standard deviation */
    double hazard;    /* probability at any row read that the robot has been put to another place */
};

struct nav_grid_settings {
    double cell_m;      /* edge of a cell; 0: as the scene's detail asks (measurement.h) */
    double cell_deg;    /* its extent in heading; 0: as its edge asks */
    double sub;         /* likelihood: sub-poses per cell edge */
    double sub_heading; /* likelihood: sub-poses per cell heading */
};

struct nav_foveal_settings {
    double cells;       /* per axis, odd (paper: 11) */
    double quantum_m;   /* quantisation added to each posterior covariance, standard deviation of position */
    double quantum_deg; /* quantisation added to each posterior covariance, standard deviation of heading */
    double inflate;     /* 1: every posterior covariance is blown up to the fovea's (the paper's shortcut) */
};

struct nav_particle_settings {
    double count;    /* how many; 0: as many as the belief's spread asks for (KLD) */
    double recovery; /* slow rate at which the mean weight is followed; 0: no recovery by injection */
};

struct nav_adaptive_settings {
    double most;  /* particles, at most */
    double least; /* particles, at least */
};

struct nav_settings {
    struct nav_texture_settings texture;
    struct nav_radial_settings radial;
    struct nav_normal_settings normal;
    struct nav_motion_settings motion;
    struct nav_grid_settings grid;
    struct nav_foveal_settings foveal;
    struct nav_particle_settings particle;
    struct nav_adaptive_settings adaptive;
};

/* The defaults. */
void nav_settings_default(struct nav_settings *);

/* Sets one by name; returns 0, -1 for an unknown name, -2 when the value is outside the setting's range. */
int nav_settings_set(struct nav_settings *, const char *name, double value);

/* Name, default, lowest and highest value of setting number `index`; 0, or -1 beyond the last. */
int nav_settings_describe(int index, const char **name, double *standard, double *low, double *high);
/* cffi: end */

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
