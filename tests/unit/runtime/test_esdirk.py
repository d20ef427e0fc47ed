"""The tableaux of the stiffly accurate methods: what they must satisfy, the order of runs, every kind of model."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT, scene_of

from msfp_gen import Effects, Load, Motion, Scene, Solver, Top, load_scene, presets, simulate
from msfp_gen.common.errors import RunError
from msfp_gen.motions.piecewise import ORDER

SOURCE = (ROOT / "msfp_gen" / "runtime" / "steppers" / "tableaux.c").read_text(encoding="utf-8")
ORDERS = {"tr_bdf2": (2, 3), "esdirk4": (4, 3)}  # of the method, and of the embedded one that judges it


def tableau(name):
    """A, c and the embedded weights as tableaux.c has them."""
    body = re.search(rf"msfp_tableau {name} = \{{(.*?)^\}};", SOURCE, re.DOTALL | re.MULTILINE)[1]
    macros = dict(re.findall(r"^#define (ROOT2|W|D) (.+)$", SOURCE, re.MULTILINE))
    for macro in ("W", "D", "ROOT2"):
        body = re.sub(rf"\b{macro}\b", f"({macros[macro]})", body)
    stages, gamma, lower, c, e, _, _ = eval("[" + body.replace("{", "[").replace("}", "]") + "]")
    A = np.zeros((stages, stages))
    for i, row in enumerate(lower):
        A[i, : len(row)] = row
        A[i, i] = gamma if i else 0.0
    return A, np.array(c), A[-1] - np.array(e)


def conditions(A, c, b, order):
    """What is left of the order conditions up to `order` (Hairer, Norsett and Wanner, table II.2.2)."""
    trees = {
        1: [b.sum() - 1],
        2: [b @ c - 1 / 2],
        3: [b @ c**2 - 1 / 3, b @ A @ c - 1 / 6],
        4: [b @ c**3 - 1 / 4, b @ (c * (A @ c)) - 1 / 8, b @ A @ c**2 - 1 / 12, b @ A @ A @ c - 1 / 24],
    }
    return np.array([value for k in range(1, order + 1) for value in trees[k]])


def growth(A, z):
    """R(z): what one step makes of a mode of y' = z y."""
    n = len(A)
    return 1 + z * A[-1] @ np.linalg.solve(np.eye(n) - z * A, np.ones(n))


@pytest.mark.parametrize("name", ORDERS)
def test_identities_of_the_tableau(name):
    A, c, embedded = tableau(name)
    order, judging = ORDERS[name]
    assert A.sum(axis=1) == pytest.approx(c, abs=1e-14) and c[-1] == 1  # consistent, stiffly accurate
    assert A @ c == pytest.approx(c**2 / 2, abs=1e-14)  # every stage is of order two
    assert np.abs(conditions(A, c, A[-1], order)).max() < 1e-13
    assert np.abs(conditions(A, c, embedded, judging)).max() < 1e-13
    higher = conditions(A, c, A[-1], 4) if order < 4 else conditions(A, c, embedded, 4)
    assert np.abs(higher).max() > 1e-5  # the two differ in order


@pytest.mark.parametrize("name", ORDERS)
def test_the_method_is_l_stable(name):
    A = tableau(name)[0]
    assert abs(growth(A, -1e9)) < 1e-7 and abs(growth(A, 1e9j)) < 1e-7
    assert max(abs(growth(A, 1j * y)) for y in np.logspace(-2, 6, 400)) <= 1 + 1e-12


def pendulum(method, step):
    """A mass that swings in a bowl without friction: smooth, and not stiff. Steps are all of one length.

    It ends within the smooth start of its motion: where the next piece begins, the third derivative has a kink.
    """
    bearing = presets.bearing("single-fp")
    surface = replace(bearing.surfaces[0], friction=0.0, yield_displacement=1e4)
    return Scene(
        bearing=replace(bearing, surfaces=[surface]),
        motion=Motion.harmonic(0.2, 0.05, cycles=1.0),
        top=Top.mass(1e5, 1e3, 0.5),
        effects=Effects(dimension="planar"),
        solver=Solver(method=method, rtol=1e-9, atol_angle=10.0, max_step=step, first_step=step),
        duration=4.0,
    )


@pytest.mark.parametrize(("method", "order"), [("implicit", 2), ("esdirk4", 4)])
def test_order_of_convergence(method, order):
    exact = simulate(pendulum("esdirk4", 0.01)).history.tilt_angles[-1]
    steps = (0.16, 0.08, 0.04)
    errors = [np.abs(simulate(pendulum(method, h)).history.tilt_angles[-1] - exact).max() for h in steps]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.4)


@pytest.mark.parametrize(("method", "order"), [("implicit", 2), ("esdirk4", 3)])
def test_order_of_dense_output(method, order):
    """Between the steps the stages inside decide, which are of order two, so that values are of order three."""

    def between(h):
        return simulate(replace(pendulum(method, h), output_step=0.01)).history.tilt_angles[:, 0, 1]

    fine = between(0.01)
    errors = [np.abs(between(h) - fine).max() for h in (0.16, 0.08)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)


CASES = {
    "spatial, rims": ("fenz-monotonic", {}),
    "planar": ("fenz-test2", {"dimension": "planar"}),
    "massless": ("fenz-test2", {"dimension": "planar", "sliders": "massless"}),
    "orbit": ("becker-circle-50", {}),
}


@pytest.mark.parametrize("case", CASES)
def test_same_motion_as_the_default(case):
    name, effects = CASES[case]
    runs = {}
    for method, rtol in (("implicit", 1e-6), ("esdirk4", 1e-5)):
        scene = scene_of(name, effects, {"method": method, "rtol": rtol}, output_step=0.05)
        runs[method] = simulate(scene)
    one, two = (run.history for run in runs.values())
    rows = min(len(one.time), len(two.time))
    force = np.abs(one.top_force[:rows] - two.top_force[:rows])
    assert np.sqrt(np.mean(force**2)) < 1e-3 * np.abs(one.top_force).max()
    events = [[(e.surface, e.kind) for e in run.events[:2]] for run in runs.values()]
    assert events[0] == events[1]


def test_failures_have_their_names():
    with pytest.raises(RunError, match="max_steps"):
        simulate(scene_of("fenz-test2", None, {"method": "esdirk4", "max_steps": 10}))


def struck(start, end, effects, damping=0.0, scale=60e3, **solver):
    """A triple pendulum at rest under a triangular lateral load of 10 ms; the plate then vibrates at 550 Hz."""
    load = Load.from_arrays([0, start, start + 5e-3, start + 0.01, end], np.outer([0, 0, scale, 0, 0], [1.0, 0, 0]))
    return Scene(
        presets.bearing("fenz-tfp").replace(contact_damping=damping),
        Motion(np.array([0.0, end]), np.zeros((1, 6, ORDER))),
        Top.rig(112e3, stiffness=1e8, damping=5.0, rotational_stiffness=1e8),
        effects=effects,
        load=load,
        solver=Solver(**solver),
    )


def test_a_peak_between_the_ends_of_long_steps_is_seen():
    """esdirk4 takes six steps in a period of the vibration: the largest row is 7 to 9 % below the peak."""
    planar = Effects(dimension="planar", rims=False)
    exact, long = (
        simulate(struck(1.0, 1.02, planar, rtol=rtol, method=method)).extremes.top_force[3]
        for method, rtol in (("implicit", 1e-6), ("esdirk4", 1e-4))
    )
    assert long == pytest.approx(exact, rel=0.02)


def test_a_peak_inside_a_step_has_its_derivative():
    """Constant steps, so that differences change nothing else."""

    def scene(scale):
        effects = load_scene("fenz-test2").effects
        steps = {"max_step": 4e-5, "first_step": 4e-5}
        return struck(1e-3, 0.012, effects, 1e-4, scale, method="esdirk4", rtol=1e-6, **steps)

    result = simulate(scene(60e3), gradients=["load.scale"])
    rows = np.hypot(*result.history.top_force[:, :2].T)
    assert np.ptp(np.diff(result.history.time)) < 1e-12 and result.extremes.top_force[3] > 1.0005 * rows.max()
    more, less = (simulate(scene((1 + d) * 60e3)).extremes.top_force[3] for d in (1e-4, -1e-4))
    slope = result.gradient_summary["load.scale"]["peak_force"]["radial"]
    assert slope == pytest.approx((more - less) / 2e-4, rel=1e-6)
