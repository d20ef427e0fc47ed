"""Values that constructors of histories refuse: one line with the field, what was given, and what to give."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from msfp_gen import Effects, InputError, Load, Measurement, Motion, Rotation, TwoPort

HUGE: Any = 10**400  # too large for a float
MOTION, LOAD = Motion.harmonic(0.01, 1.0, cycles=1), Load.constant((1.0, 0.0, 0.0))
REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "two components": (lambda: Load.constant((1.0, 0.0)), r"load\.force: shape \(2,\); give 3 numbers"),
    "a matrix": (lambda: Load.ramp([[0.0, 0.0, 1.0]], duration=1), r"load\.force: shape \(1, 3\); give 3 numbers"),
    "a moment": (
        lambda: Load.harmonic((0, 0, 1), 5.0, frequency=1, cycles=1),  # type: ignore[arg-type]
        r"load\.moment: shape \(\); give 3 numbers|load\.moment: shape \(1,\); give 3 numbers",
    ),
    "many angles": (lambda: Rotation.constant([1e-3] * 3, [1e-3] * 3), r"rotation: shape \(2, 3\); give 2 numbers"),  # type: ignore[arg-type]
    "huge": (lambda: Load.constant((HUGE, 0, 0)), r"load\.force: not an array of numbers"),
    "huge amplitude": (lambda: Motion.harmonic(HUGE, 1.0), "amplitude: 1000.*is not a number"),
    "huge matrix": (lambda: Motion.from_arrays(HUGE, [[0.0] * 3]), "time: not an array of numbers"),
    "complex": (lambda: Load.constant(np.array([1j, 0, 0])), r"load\.force: not an array of numbers"),
    "times": (lambda: Rotation.from_arrays([[0, 1]], [[0, 0]]), r"rotation\.time: shape \(1, 2\); give times in one"),
    "unsorted": (
        lambda: Load.from_arrays([0, 2, 1.5], np.zeros((3, 3))),
        r"load\.time\[2\]: 1\.5 s is before 2\.0 s; sort the samples",
    ),
    "late": (lambda: Load.from_arrays([1, 2], np.zeros((2, 3))), r"load\.time: .*first \[1\.\]; give .* of them zero"),
    "direction": (lambda: Motion.harmonic(0.01, 1.0, direction=np.nan), r"direction.*nan is not finite"),
    "azimuth": (lambda: Motion.ramp(0.1, 1.0, direction="E1"), r"direction: not an array of numbers"),  # type: ignore[arg-type]
    "phase": (lambda: Load.harmonic((1, 0, 0), frequency=1, cycles=1, phase=np.inf), r"load\.phase.*inf is not finite"),
    "angle": (lambda: MOTION.rotated(np.inf), r"angle.*inf is not finite"),
    "angles": (lambda: MOTION.rotated([0.1, 0.2]), r"angle: shape \(2,\); give one number"),  # type: ignore[arg-type]
    "rocking": (lambda: MOTION.rocking(LOAD), r"rotation = .*: give a Rotation"),  # type: ignore[arg-type]
    "a time": (lambda: LOAD.evaluate("1 s"), "time: not an array of numbers"),
    "no time": (lambda: LOAD.evaluate(-np.inf), "time.*-inf is not finite"),
    "an order": (lambda: LOAD.evaluate(0.5, 1.5), r"derivative: 1\.5; give 0"),  # type: ignore[arg-type]
    "a negative order": (lambda: MOTION.evaluate(0.5, -1), r"derivative: -1; give 0"),
    "a record": (lambda: Motion.from_record("a.v2"), r"record = 'a\.v2': give a Record"),  # type: ignore[arg-type]
    "a test": (lambda: Measurement("test", ["a"] * 20, [0.0] * 20, [0.0] * 20), "test: time: not an array of numbers"),  # type: ignore[arg-type]
    "a port": (lambda: TwoPort.of_scene("fenz-test2"), r"scene = 'fenz-test2': give a Scene"),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("name", REFUSED)
def test_odd_values_are_named(name: str) -> None:
    build, message = REFUSED[name]
    with pytest.raises(InputError, match=message) as caught:
        build()
    assert "\n" not in str(caught.value)


def test_a_word_of_an_array_is_a_word() -> None:
    effects = Effects(sliders=np.array(["massless"])[0])
    assert effects == Effects(sliders="massless") and type(effects.sliders) is str
    with pytest.raises(InputError, match=r"effects\.rims = 1: give one of True, False"):
        Effects(rims=1)  # type: ignore[arg-type]
