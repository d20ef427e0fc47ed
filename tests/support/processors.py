"""What runs are computed from, and rows: `python -m support.processors FILE` writes them for a comparison."""

from __future__ import annotations

import sys
from dataclasses import fields, replace

import numpy as np

from msfp_gen import Motion, load_scene, simulate
from msfp_gen.model.plane import motion_in_plane
from msfp_gen.motions import records
from msfp_gen.studies.axes import Distribution
from support import Array


def wide_features() -> list[str]:
    """Names of the versions of NumPy's functions for vectors of 512 bits; NPY_DISABLE_CPU_FEATURES takes them."""
    from numpy._core._multiarray_umath import __cpu_dispatch__

    return [name for name in __cpu_dispatch__ if name == "X86_V4" or name.startswith("AVX512")]


def motions() -> dict[str, Motion]:
    """One of every constructor, and of every change of a motion."""
    time = 0.01 * np.arange(400)
    noise = np.random.default_rng(1).standard_normal((400, 3))
    wave = Motion.harmonic(0.05, 0.63, direction=0.4, cycles=3)
    record = records.bundled("ridgecrest-2019-ci-clc")
    return {
        "harmonic": wave,
        "circle": Motion.circle(0.05, 0.7),
        "figure of eight": Motion.figure_eight(0.05, 0.7),
        "ramp": Motion.ramp(0.1, 3.0, direction=0.3),
        "displacement": Motion.from_arrays(time, noise),
        "velocity": Motion.from_velocity(time, noise),
        "acceleration": Motion.from_acceleration(time, noise),
        "record": Motion.from_record(record, duration=20.0),
        "rotated record": Motion.from_record(record.rotated(0.3)),
        "rotated": wave.rotated(0.3),
        "held": Motion.harmonic(0.05, 0.63, cycles=3, direction=0.1).held(1.0),
        "sum": wave + wave.rotated(1.1),
        "in its plane": motion_in_plane(wave, wave.plane() or 0.0),
    }


def inputs() -> dict[str, Array]:
    """Coefficients of motions, and values that a study draws."""
    found = {name: each.coefficients for name, each in motions().items()}
    shares = np.random.default_rng(2).random(2000)
    for kind, parameters in (("lognormal", (0.05, 0.2)), ("normal", (0.05, 0.01)), ("triangular", (0.0, 0.3, 1.0))):
        found[kind] = Distribution(kind, parameters).values(shares)
    return found


def rows() -> dict[str, Array]:
    """Rows of a run in space and of one in an oblique plane, by run and field."""
    scene = load_scene("becker-eight-50")
    wave = replace(load_scene("fenz-test2"), motion=Motion.harmonic(0.025, 0.4, direction=0.4, cycles=1))
    found = {}
    for name, each in (("space", replace(scene, duration=25.0)), ("plane", wave)):
        history = simulate(each).history
        for field in fields(history):
            if isinstance(value := getattr(history, field.name), np.ndarray):
                found[f"{name} {field.name}"] = value
    return found


if __name__ == "__main__":
    np.savez(sys.argv[1], **inputs(), **rows())
