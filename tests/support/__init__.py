"""What several test files share: models, bearings of reference stacks, numerical differences, runs that may fail."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from msfp_gen import Bearing, Body, Effects, Layout, RunError, Scene, Surface, build_model, simulate
from msfp_gen.model.model import Model
from msfp_gen.results.result import Result

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "benchmarks"))  # also in the processes that tests start
from plain import plain_scene  # noqa: E402

Array = np.ndarray[Any, np.dtype[np.float64]]


def bearing_of(values: Any) -> Bearing:
    """The public Bearing with the numbers of a reference stack."""
    layout = Layout(values.layout.n, values.layout.m, values.layout.p)
    return Bearing(
        layout=layout,
        base_height=values.base_height,
        gravity=values.gravity,
        base_rim_radius=values.base_rim_radius,
        base_rim_offset=values.base_rim_offset,
        base_centroid=values.base_centroid,
        surfaces=[Surface(**vars(s)) for s in values.surfaces],
        bodies=[Body(**vars(b)) for b in values.bodies],
    )


@cache
def model_of(layout: tuple[int, int, int], **effects: Any) -> Model:
    """The model of a layout, with the hysteresis law of PEER 2017/07 unless another is given."""
    return build_model(Layout(*layout), Effects(**{"bouc_wen": "report", **effects}))


def differences(function: Any, x: Array, steps: Array) -> Array:
    """Jacobian by eighth-order central differences."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    columns = []
    for i, h in enumerate(steps):
        unit = np.eye(len(x))[i] * h
        columns.append(sum(w * (function(x + k * unit) - function(x - k * unit)) for k, w in weights.items()) / h)
    return np.array(columns).T


Changes = dict[str, Any]


def scene_of(name: str, effects: Changes | None = None, solver: Changes | None = None, **changes: Any) -> Scene:
    """A scene of `plain_scene` with some effects, settings of the solver and other parts changed."""
    scene = plain_scene(name)
    changes["effects"] = replace(scene.effects, **(effects or {}))
    changes["solver"] = replace(scene.solver, **(solver or {}))
    return replace(scene, **changes)


def endless(count: int) -> list[Scene]:
    """Runs of about a minute each."""
    return [scene_of("fenz-test2", solver={"method": "dopri5", "rtol": 1e-5})] * count


@cache
def preset_run(name: str, **effects: Any) -> Result:
    """A preset scene as it stands, apart from effects; run once for all tests."""
    return simulate(scene_of(name, effects))


def failure_of(scene: Scene) -> RunError:
    """The RunError that a scene ends in."""
    try:
        simulate(scene)
    except RunError as error:
        return error
    raise AssertionError("the run did not fail")


def thinned(cases: Iterable[Any], keep: Callable[..., bool]) -> list[Any]:
    """Parameters of a test: the cases that `keep` takes as they are, the others under the mark `slow`.

    A model that no other test uses costs four seconds of compiling; which kernels it holds is decided by its effects,
    not by its layout, so that few of all combinations need to be built with every change.
    """
    rows = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*row, marks=() if keep(*row) else pytest.mark.slow) for row in rows]


def hearing() -> None:
    """In a new process: hear the signals that the tests may have been told to ignore themselves (nohup, `&`)."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
