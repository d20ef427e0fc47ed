"""The fast tangent of a step, which is composed by hand (tangent.c), against that emitted from the schedule."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import bearing_of, model_of
from support.friction_scenes import VALUES
from support.random_states import sensible

from msfp_gen import Top

LAYOUTS = [(2, 1, 0), (2, 0, 1), (3, 1, 1), (4, 2, 1), (5, 2, 2), (5, 1, 3), (7, 3, 3), (11, 5, 5)]
EFFECTS = [
    {},
    {"spin": "free"},
    {"spin": "patch", "friction": "pvt"},
    {"dimension": "planar"},
    {"sliders": "massless", "rims": False},
    {"top_rotation": True},
]
CASES = [*((layout, {}) for layout in LAYOUTS), *(((5, 2, 2), effects) for effects in EFFECTS[1:])]
QUICK = [((2, 1, 0), {}), ((3, 1, 1), {})]  # whose fast models other tests have too
FORWARD = "-DMSFP_FORWARD_TANGENT=1"
"""The emitted tangent in place of that of tangent.c (equations.h)."""


def tangents(layout: tuple[int, int, int], effects: dict[str, object]) -> list[np.ndarray]:
    """Tangents of a step at random states below a sprung mass, with no rim met and with every rim met."""
    model = model_of(layout, **effects)
    planar = effects.get("dimension") == "planar"
    keep, in_plane = (
        np.array([0.0, 1.0, 0.0]) if planar else np.ones(3),
        np.array([1, 0, 1, 0, 1, 0]) if planar else 1.0,
    )
    top = Top.mass(3e3, 2e3, 0.3, rotational_stiffness=1e7, vertical_stiffness=1e5, vertical_damping=1e3)
    found = []
    for seed, met in ((7, False), (8, True)):
        values, state, h, load = sensible(layout, seed)
        bearing = bearing_of(values).replace(**VALUES.get(effects.get("friction", ""), {}))
        if met:
            bearing = bearing.replace(capacity=[1e-4] * (layout[0] - 1))
        q, v, a = (np.ascontiguousarray(x * keep) for x in (state.q, state.v, state.a))
        f = np.ascontiguousarray(0.5 * h * [1.0, 0.0 if planar else 1.0])
        base = np.random.default_rng(seed).uniform(-0.1, 0.1, (3, 6)) * in_plane
        loads = np.r_[load.force, load.moment] * in_plane
        seeds = (1e-3, 1.0, 1e3, 1e-3)
        status, _, tangent, _ = model.stack(bearing, top).condensed(
            q, v, a, f, base, loads, *seeds, foot=np.array([0.0, 0.1])
        )
        assert status == "ok"
        found.append(tangent)
    return found


@pytest.mark.parametrize(
    ("layout", "effects"),
    [pytest.param(*case, marks=[] if case in QUICK else pytest.mark.slow) for case in CASES],
    ids=str,
)
def test_fast_tangent_equals_the_emitted_one(layout, effects):
    command = [sys.executable, __file__, json.dumps([layout, effects])]
    environment = os.environ | {"MSFP_GEN_CFLAGS": FORWARD, "PYTHONPATH": str(Path(__file__).parents[1])}
    environment["PYTHONPATH"] += os.pathsep + os.environ.get("PYTHONPATH", "")
    run = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert run.returncode == 0, run.stderr
    emitted = [np.array(one) for one in json.loads(run.stdout)]
    for fast, forward in zip(tangents(layout, effects), emitted, strict=True):
        assert 0.0 < np.abs(fast - forward).max() < 1e-12 * np.abs(forward).max()


if __name__ == "__main__":
    layout, effects = json.loads(sys.argv[1])
    print(json.dumps([one.tolist() for one in tangents(tuple(layout), effects)]))
