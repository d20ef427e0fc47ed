"""Scenes under laws of the friction coefficient, with numbers that let each law act."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from msfp_gen import Motion, Scene, simulate
from msfp_gen.results.result import Result
from support import scene_of

FORMULA = "mu * (1 - c1 * exp(-c2 * v)) * Max(1 - tanh(N / c3) / 5, 0.5)"
LAWS: dict[str, dict[str, Any]] = {"velocity": {}, "pvt": {}, "custom": {"friction_law": FORMULA}}
VALUES: dict[str, dict[str, Any]] = {
    "velocity": {"friction_slow": 0.01, "velocity_rate": 20.0},
    "pvt": {"reference_pressure": 2e6, "velocity_rate": 20.0},
    "custom": {"c1": 0.5, "c2": 20.0, "c3": 2e4},
}
P_REF, RADIUS = 15e6, 0.025


def lawful(scene: Scene, word: str, text: str | None = None, **values: Any) -> Scene:
    """A scene with another law, its surfaces carrying the numbers."""
    effects = replace(scene.effects, friction=word, friction_law=text)
    return replace(scene, effects=effects, bearing=scene.bearing.replace(**values))


@cache
def heated(thickness: float = 0.0, hold: float = 0.0, **effects: Any) -> Result:
    """Quick strokes of small patches under a real load: what heats. Then the base is at rest for `hold` [s].

    thickness: of the heated plates [m]; 0: half-spaces.
    """
    motion = Motion.harmonic(0.08, 1.0, cycles=2.0)
    motion = motion.held(hold) if hold else motion
    scene = scene_of("fenz-test2", {"dimension": "planar", **effects}, {"rtol": 1e-5}, motion=motion, duration=None)
    values = {"plate_thickness": thickness} if thickness else {}
    law = "pvtd" if thickness else "pvt"
    return simulate(lawful(scene, law, reference_pressure=P_REF, patch_radius=RADIUS, **values))
