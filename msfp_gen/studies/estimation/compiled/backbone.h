/* A mass on the published backbone of its bearings: steps of a fixed length. */
#ifndef MSFP_BACKBONE_H
#define MSFP_BACKBONE_H

#define MSFP_BACKBONE_MOST 64 /* elements in parallel */

typedef struct {
    int count, gaps;
    const double *stiffness, *strength; /* of the elements of friction, over the load [1/m], [-] */
    double spring;                      /* in parallel, over the load [1/m] */
    const double *gap, *gap_stiffness;  /* displacement beyond which a spring acts [m], its stiffness [1/m] */
    double gravity, stop;               /* [m/s^2]; displacement that ends the run, 0: none [m] */
} msfp_backbone;

typedef struct {
    double displacement, force; /* largest displacement [m], and horizontal force over the mass [m/s^2] */
    long steps;                 /* that were taken */
} msfp_backbone_peaks;

/* ground: accelerations along E1, E2, E3 at the beginning of every step [m/s^2], shape (steps, 3). */
msfp_backbone_peaks msfp_backbone_run(const msfp_backbone *model, const double *ground, long steps, double step);

#endif
