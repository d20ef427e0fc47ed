# cython: language_level=3, embedsignature=True
"""A mass on the published backbone of its bearings in compiled code (backbone.h): `run`."""

import numpy as np

cdef extern from "backbone.h":
    enum: MSFP_BACKBONE_MOST
    ctypedef struct msfp_backbone:
        int count, gaps
        const double *stiffness
        const double *strength
        double spring
        const double *gap
        const double *gap_stiffness
        double gravity, stop
    ctypedef struct msfp_backbone_peaks:
        double displacement, force
        long steps
    msfp_backbone_peaks msfp_backbone_run(const msfp_backbone *, const double *, long, double) noexcept nogil

MOST = MSFP_BACKBONE_MOST


def run(elements, double spring, gaps, ground, double step, double gravity, double stop):
    """Largest displacement [m], force over mass [m/s^2], and steps. elements, gaps: (2, k); ground: (steps, 3)."""
    cdef const double[:, ::1] e = np.ascontiguousarray(elements, dtype=float)
    cdef const double[:, ::1] g = np.ascontiguousarray(gaps, dtype=float)
    cdef const double[:, ::1] a = np.ascontiguousarray(ground, dtype=float)
    cdef msfp_backbone model
    cdef msfp_backbone_peaks peaks
    if e.shape[0] != 2 or g.shape[0] != 2 or a.shape[1] != 3 or not 0 < e.shape[1] <= MSFP_BACKBONE_MOST:
        raise ValueError("elements and gaps have two rows, the ground three columns")
    if not g.shape[1] or not a.shape[0]:
        raise ValueError("there are no gaps, or no steps")
    model.count, model.gaps = <int>e.shape[1], <int>g.shape[1]
    model.stiffness, model.strength = &e[0, 0], &e[1, 0]
    model.gap, model.gap_stiffness = &g[0, 0], &g[1, 0]
    model.spring, model.gravity, model.stop = spring, gravity, stop
    with nogil:
        peaks = msfp_backbone_run(&model, &a[0, 0], a.shape[0], step)
    return peaks.displacement, peaks.force, peaks.steps
