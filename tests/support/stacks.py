"""What the hard cases share: plain stacks, slow pushes held against the reference, pendulums, properties."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.internal.conjecture import providers
from reference.friction_circle import Push
from reference.quasi_static import follow

from msfp_gen import Bearing, Body, Effects, Layout, Motion, Scene, Solver, Surface, Top, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.scene_fields import InitialState
from support import Array

LOAD, TILT_STIFFNESS, SIDE_STIFFNESS = 1e5, 1e6, 1e9
PLANAR = Effects(dimension="planar", bouc_wen="report")


def a_surface(radius: float, **values: Any) -> Surface:
    """A surface with some travel, 5 % of friction and a rim without damping; any value may be given."""
    usual = {"capacity": 0.3 * radius, "friction": 0.05, "yield_displacement": 5e-4, "rim_stiffness": 1e7}
    return Surface(**{"radius": radius, **usual, **values})


def a_body(mass: float = 0.5, height: float = 0.02, **values: Any) -> Body:
    """A disc of 6 cm across that weighs little; any value may be given."""
    inertia = (0.25 * mass * 0.03**2 + mass * height**2 / 12, 0.5 * mass * 0.03**2)
    usual = {"height": height, "centroid": height / 2, "mass": mass, "inertia": inertia, "rim_radius": 0.01}
    return Body(**{**usual, **values})


def a_stack(
    layout: tuple[int, int, int],
    radii: Sequence[float],
    body: dict[str, Any] | None = None,
    gravity: float = 9.8,
    **columns: Any,
) -> Bearing:
    """A bearing with these radii, bottom first; columns: one value for every surface, or a list of them."""
    rows = [{name: (x[i] if isinstance(x, Sequence) else x) for name, x in columns.items()} for i in range(len(radii))]
    return Bearing(
        layout=Layout(*layout),
        base_height=0.02,
        base_rim_radius=0.01,
        gravity=gravity,
        surfaces=[a_surface(radius, **row) for radius, row in zip(radii, rows, strict=True)],
        bodies=[a_body(**(body or {})) for _ in radii],
    )


def nested_radii(layout: tuple[int, int, int], outer: float = 1.0, ratio: float = 0.5) -> list[float]:
    """Radii that shrink towards the middle, as in any bearing that does not snap through."""
    _, up, down = layout
    return [outer * ratio**i for i in range(up)] + [outer * ratio**i for i in range(down)][::-1]


def a_rig(load: float = LOAD, tilt: float = TILT_STIFFNESS, side: float = SIDE_STIFFNESS) -> Top:
    return Top.rig(load, side, 0.0, tilt, 0.0)


def slow_path(turns: Sequence[float], speed: float = 2e-3) -> Motion:
    """A base that goes from one place [m] to the next along E1 and rests at each: quintics, at 2 mm/s on average."""
    ends = np.concatenate([[0.0], turns])
    times = np.concatenate([[0.0], np.cumsum(np.maximum(np.abs(np.diff(ends)) / speed, 0.5))])
    pieces = np.zeros((len(turns), 6, 6))
    for i, (h, d) in enumerate(zip(np.diff(times), np.diff(ends), strict=True)):
        pieces[i, 0, 0] = ends[i]
        pieces[i, 0, 3:] = 10 * d / h**3, -15 * d / h**4, 6 * d / h**5
    return Motion(knots=times, coefficients=pieces)


def pushed(
    bearing: Bearing,
    turns: Sequence[float],
    *,
    load: float = LOAD,
    tilt: float = TILT_STIFFNESS,
    effects: Effects = PLANAR,
    speed: float = 2e-3,
    **solver: Any,
) -> Result:
    """A run of `slow_path` on a rig."""
    scene = Scene(bearing, slow_path(turns, speed), a_rig(load, tilt), effects=effects, solver=Solver(**solver))
    return simulate(scene)


def off_the_reference(run: Result, rows: int = 60, stride: float = 1e-3) -> float:
    """Largest distance of the force along E1 from the quasi-static stack at the same displacements, over its peak.

    Turns of the path are among the rows, so that the reference turns where the run does.
    """
    top: Any = run.scene.top
    u, force = run.history.displacement[:, 0], run.history.top_force[:, 0]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1
    keep = np.unique([*range(0, len(u), max(1, len(u) // rows)), *turns, len(u) - 1])
    push = Push(run.scene.bearing, top.axial_load, top.rotational_stiffness, weights=True)
    want = np.array([here.force for here in follow(push, list(u[keep]), stride=stride)])
    return float(np.abs(force[keep] - want).max() / np.abs(want).max())


# ---- one frictionless pendulum ---------------------------------------------------------------------------------


def a_pendulum(radius: float = 0.5, mass: float = 2.0, height: float = 0.02, **values: Any) -> Bearing:
    """One slider in one bowl without friction; Y, Z hardly move, so that only the pendulum is integrated."""
    usual = {"friction": 0.0, "yield_displacement": 1e6, "capacity": 1.45 * radius}
    body = {"mass": mass, "height": height, "rim_radius": 0.02 * radius}
    return a_stack((2, 1, 0), [radius], body=body, **{**usual, **values})


def swing(bearing: Bearing, angle: float, duration: float, rate: float = 0.0, **changes: Any) -> Scene:
    """The pendulum let go at a tilt [rad] with a rate [rad/s]; nothing stands on it."""
    still = Motion(knots=[0.0, duration], coefficients=np.zeros((1, 6, 6)))
    start = InitialState([[0.0, angle, 0.0]], [[0.0, rate, 0.0]], [[0.0, 0.0]])
    free = Top.prescribed((0.0, 0.0, 0.0))
    return replace(Scene(bearing, still, free, effects=PLANAR, initial_state=start), **changes)


def arm_and_inertia(bearing: Bearing) -> tuple[float, float]:
    """R - z and J + m (R - z)^2 of the pendulum."""
    body, arm = bearing.bodies[0], bearing.surfaces[0].radius - bearing.bodies[0].centroid
    return arm, body.moments[0] + body.mass * arm**2


def pendulum_angle(bearing: Bearing, start: float, time: Array) -> Array:
    """Tilt of the pendulum let go at `start`: 2 asin(k sn(K - w t)) with k = sin(start/2)."""
    from scipy.special import ellipj, ellipk

    arm, inertia = arm_and_inertia(bearing)
    w, k = np.sqrt(bearing.bodies[0].mass * bearing.gravity * arm / inertia), np.sin(start / 2)
    angle: Array = 2 * np.arcsin(k * ellipj(ellipk(k**2) - w * time, k**2)[0])
    return angle


# ---- properties ------------------------------------------------------------------------------------------------


# Hypothesis also draws from the numbers in whatever modules of ours are loaded by then: examples would depend on
# which tests run and on whether a model is built on the way. There is no setting against that.
assert callable(providers.is_local_module_file)
providers.is_local_module_file = lambda path: False  # type: ignore[assignment]


def holds(
    few: int, many: int, quick: dict[str, Any] | None = None, **strategies: Any
) -> Callable[[Callable[..., None]], Callable[[int], None]]:
    """A property as a test: `few` examples, always the same ones; `many` under the mark `slow`.

    quick: strategies of the few, where those of the many need models that no other test builds.
    """

    def wrap(check: Callable[..., None]) -> Callable[[int], None]:
        @pytest.mark.parametrize("examples", [few, pytest.param(many, marks=pytest.mark.slow)])
        def test(examples: int) -> None:
            calm = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
            profile = settings(
                max_examples=examples,
                derandomize=True,
                deadline=None,
                database=None,
                suppress_health_check=calm,
                phases=[Phase.generate],
            )
            chosen = {**strategies, **(quick or {})} if examples == few else strategies
            profile(given(**chosen)(check))()

        test.__name__, test.__doc__ = check.__name__, check.__doc__
        return test

    return wrap
