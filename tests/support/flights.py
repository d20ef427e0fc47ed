"""A bearing shaken vertically until its bodies part."""

from __future__ import annotations

import numpy as np

from msfp_gen import Effects, Motion, Scene, Solver, Top, presets

UPLIFT = Effects(dimension="planar", uplift=True)
G = 9.8
SHAKE = 2 * np.pi * 2.0  # [rad/s]


def shaken(peak, *, effects=UPLIFT, rtol=1e-4, sideways=0.0, duration=1.6):
    """A rigid mass on the prototype, shaken vertically with `peak` g at 2 Hz after a smooth start of 0.5 s."""
    t = np.linspace(0, duration, int(duration * 400) + 1)
    start = np.clip(t / 0.5, 0, 1)
    wave = start**3 * (10 - 15 * start + 6 * start**2)
    u = np.zeros((len(t), 3))
    u[:, 2] = peak * G / SHAKE**2 * wave * np.sin(SHAKE * t)
    u[:, 0] = sideways * wave * np.sin(0.5 * SHAKE * t)
    bearing = presets.bearing("prototype-tfp")
    top = Top.mass(mass=11428.0, inertia=300.0, height=0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    return Scene(bearing, Motion.from_arrays(t, u), top, effects=effects, solver=Solver(rtol=rtol))
