/* The magnetic field a sensor sees. */
#ifndef SIM_FIELD_H
#define SIM_FIELD_H

/* Field angles in degrees from rest; the sensor's own scale adds 90. */
struct sim_field {
    double alpha_deg, beta_deg;
};

#endif
