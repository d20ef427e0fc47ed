"""Motions of the ends of a two-port for tests: smooth, from rest, with all twelve components."""

from __future__ import annotations

import numpy as np

from msfp_gen import Bearing, Effects, Solver, Top, TwoPort, presets
from support import Array

BEARING = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
LOAD = 112e3
INTERFACE = Top.node(1e7, 5e7, 1e6, damping=1e4, vertical_damping=1e5, rotational_damping=1e3)
PERIOD = 2.0  # of `swing` [s]
# Amplitudes of the lower and the upper end [m], [rad].
SWING = np.array([[0.01, 0.008, 0.0005, 0.01, 0.015, 0.01], [0.05, -0.03, 0.0004, -0.012, 0.01, 0.02]])
STILL = np.zeros((3, 6))


def swing(time: float, amplitude: Array = SWING) -> Array:
    """Motion of both ends, shape (2, 3, 6): sin^3, so that accelerations start from zero."""
    w = 2 * np.pi / PERIOD
    s, c = np.sin(w * time), np.cos(w * time)
    return np.stack(
        [amplitude * s**3, amplitude * 3 * w * s**2 * c, amplitude * 3 * w**2 * (2 * s * c**2 - s**3)], axis=1
    )


def port(rtol: float = 1e-4, bearing: Bearing = BEARING, effects: Effects | None = None, **solver: object) -> TwoPort:
    return TwoPort(bearing, INTERFACE, LOAD, effects, Solver(rtol=rtol, **solver))  # type: ignore[arg-type]


def advance(two_port: TwoPort, start: int, end: int, step: float, amplitude: Array = SWING) -> Array:
    """Commit the steps start + 1 ... end of `swing`; the wrenches, shape (steps, 2, 6)."""
    found = []
    for i in range(start + 1, end + 1):
        found.append(two_port.trial(i * step, *swing(i * step, amplitude)).wrench)
        two_port.commit()
    return np.array(found)
