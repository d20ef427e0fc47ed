"""Orders of the methods on a smooth case, identities of their tableaux read from the C, dense output, stop points."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from support import Array
from support.stacks import PLANAR, a_pendulum, a_rig, a_stack, pendulum_angle, slow_path, swing

import msfp_gen
from msfp_gen import Motion, Scene, Solver, simulate
from msfp_gen.scene.scene_fields import Stop

RUNTIME = Path(msfp_gen.__file__).parent / "runtime" / "steppers"
START = 0.6
# Steps [s] small enough for the order to show and large enough to stay clear of rounding.
STEPS = {"implicit": [0.02, 0.01, 0.005, 0.0025], "dopri5": [0.025, 0.0125, 0.00625]}


def errors(method: str, step: float, output: float | None = None) -> Array:
    """Error of the tilt of a frictionless pendulum in every row, with every step of one size: nothing is rejected."""
    fixed = Solver(method=method, rtol=1e-8, atol_angle=1e6, first_step=step, max_step=step)  # type: ignore[arg-type]
    run = simulate(replace(swing(a_pendulum(), START, 1.0, solver=fixed), output_step=output))
    assert run.counters.steps == round(1.0 / step) and run.counters.rejected_steps == 0
    wanted = pendulum_angle(a_pendulum(), START, run.history.time)
    return np.abs(run.history.tilt_angles[:, 0, 1] - wanted)


def orders(values: list[float]) -> list[float]:
    return [float(np.log2(coarse / fine)) for coarse, fine in pairwise(values)]


@pytest.mark.parametrize(("method", "order"), [("implicit", 2), ("dopri5", 5)])
def test_order_of_the_method(method: str, order: int) -> None:
    assert orders([errors(method, h)[-1] for h in STEPS[method]])[-1] == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize(("method", "order"), [("implicit", 2), ("dopri5", 4)])
def test_order_of_dense_output(method: str, order: int) -> None:
    """Rows between the steps: a parabola through the middle stage, or the cubic of values and rates."""
    found = orders([errors(method, h, 0.37 * h).max() for h in STEPS[method]])
    assert found[-1] == pytest.approx(order, abs=0.2)


def test_order_with_friction_where_it_is_smooth() -> None:
    """Monotonic sliding under a soft yield: Y is a tanh, nothing switches. Against steps eight times shorter."""
    bearing = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=0.05, body={"mass": 1e-3})
    scene = Scene(bearing, slow_path([0.1], 0.05), a_rig(), effects=PLANAR)

    def last(step: float) -> Array:
        fixed = Solver(rtol=1e-5, atol_angle=1e6, first_step=step, max_step=step)
        run = simulate(replace(scene, solver=fixed, duration=1.0))
        assert run.counters.rejected_steps == 0
        return run.history.friction_state[-1, :, 0]

    wanted = last(1 / 1600)
    found = orders([float(np.abs(last(h) - wanted).max()) for h in (1 / 50, 1 / 100, 1 / 200)])
    assert found[-1] == pytest.approx(2, abs=0.2)


# ---- tableaux --------------------------------------------------------------------------------------------------


def dopri5_tableau() -> tuple[list[list[Fraction]], list[Fraction], list[Fraction]]:
    """a (7, 7), c, and weights less embedded weights, as exact fractions, from the C."""
    text = (RUNTIME / "dopri5.c").read_text(encoding="utf-8")

    def numbers(body: str) -> list[Fraction]:
        return [Fraction(term.strip().replace(".0", "").replace(" ", "")) for term in body.split(",")]

    table = re.search(r"double a\[STAGES\]\[STAGES - 1\] = \{(.*?)\n\};", text, re.DOTALL)
    assert table
    rows = [numbers(row) for row in re.findall(r"\{([^{}]*)\}", table[1])]
    a = [row + [Fraction(0)] * (7 - len(row)) for row in rows]
    c, e = (re.search(rf"double {name}\[STAGES\] = \{{(.*?)\}};", text, re.DOTALL) for name in "ce")
    assert c and e
    return a, numbers(c[1]), numbers(e[1])


def residuals(a: Array, c: Array, b: Array) -> dict[int, list[object]]:
    """Order conditions of a Runge-Kutta method up to order five, one for each rooted tree, by order."""
    one, ac = c * 0 + 1, a @ c
    trees = {
        1: [(one, 1)],
        2: [(c, 2)],
        3: [(c**2, 3), (ac, 6)],
        4: [(c**3, 4), (c * ac, 8), (a @ c**2, 12), (a @ ac, 24)],
        5: [
            (c**4, 5),
            (c**2 * ac, 10),
            (ac**2, 20),
            (c * (a @ c**2), 15),
            (c * (a @ ac), 30),
            (a @ c**3, 20),
            (a @ (c * ac), 40),
            (a @ (a @ c**2), 60),
            (a @ (a @ ac), 120),
        ],
    }
    return {order: [b @ tree - Fraction(1, n) for tree, n in group] for order, group in trees.items()}


def test_dormand_prince_tableau_is_exact() -> None:
    rows, nodes, difference = dopri5_tableau()
    a, c, e = (np.array(x, dtype=object) for x in (rows, nodes, difference))
    assert list(a.sum(axis=1)) == list(c)
    weights = a[6]  # first same as last
    full, embedded = residuals(a, c, weights), residuals(a, c, weights - e)
    assert not any(x for group in full.values() for x in group)
    assert not any(x for order in range(1, 5) for x in embedded[order]) and any(embedded[5])


def tr_bdf2_tableau() -> tuple[Array, Array, Array]:
    """a (3, 3), c, and weights less embedded weights, evaluated from the C."""
    text = (RUNTIME / "tableaux.c").read_text(encoding="utf-8")
    names: dict[str, float] = {}
    for name in ("ROOT2", "W", "D"):
        found = re.search(rf"#define {name} (.+)", text)
        assert found
        names[name] = arithmetic(found[1].split("/*")[0], names)
    table = re.search(r"msfp_tableau tr_bdf2 = \{(.*?)\n\};", text, re.DOTALL)
    assert table
    numbers = [arithmetic(x, names) for x in re.sub(r"[{}\n]", " ", table[1]).split(",") if x.strip()]
    (stages, gamma), lower, rest = numbers[:2], numbers[2:6], numbers[6:12]
    assert stages == 3
    a = gamma * np.diag([0.0, 1.0, 1.0])
    a[0, 0], a[1, 0], a[2, 0], a[2, 1] = lower
    return a, np.array(rest[:3]), np.array(rest[3:])


def arithmetic(text: str, names: dict[str, float]) -> float:
    """The value of a constant expression of C: numbers, the names before it, + - * / and brackets."""
    for name, value in names.items():
        text = re.sub(rf"\b{name}\b", repr(value), text)
    assert re.fullmatch(r"[\d.e+\-*/() ]+", text), text
    return float(eval(text, {"__builtins__": {}}))


def test_tr_bdf2_tableau_is_the_one_of_hosea_and_shampine() -> None:
    a, c, e = tr_bdf2_tableau()
    root = sqrt(2.0)
    assert a.sum(axis=1) == pytest.approx(c, abs=1e-15)
    assert c == pytest.approx([0, 2 - root, 1]) and a[1, 0] == a[1, 1]  # the trapezoidal rule to 2 - sqrt(2)
    assert a[2] == pytest.approx([root / 4, root / 4, 1 - root / 2], abs=1e-15)  # BDF2 from there; stiffly accurate
    full, embedded = residuals(a, c, a[2]), residuals(a, c, a[2] - e)
    assert max(abs(x) for order in (1, 2) for x in full[order]) < 1e-15 < max(abs(x) for x in full[3])
    assert max(abs(x) for order in (1, 2, 3) for x in embedded[order]) < 1e-15


def test_tr_bdf2_is_l_stable() -> None:
    """|R(z)| <= 1 on the imaginary axis and in the left half plane, and R tends to 0."""
    a, _, _ = tr_bdf2_tableau()

    def growth(z: complex) -> complex:
        stages = np.linalg.solve(np.eye(3) - z * a, np.ones(3))
        return complex(1 + z * (a[2] @ stages))

    sizes = np.logspace(-3, 8, 60)
    for angle in np.linspace(np.pi / 2, 3 * np.pi / 2, 9):
        values = [abs(growth(s * complex(np.cos(angle), np.sin(angle)))) for s in sizes]
        assert max(values) < 1 + 1e-12 and values[-1] < 1e-6


# ---- stop points -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_run_lands_on_jumps_and_on_its_end_exactly(method: str) -> None:
    pieces, knots = np.zeros((3, 6, 6)), np.array([0.0, 0.1, 0.1 + 1 / 30, 0.2])
    speed = place = 0.0
    for i, (acceleration, length) in enumerate(zip((0.5, -0.5, 0.2), np.diff(knots), strict=True)):
        pieces[i, 0, :3] = place, speed, acceleration / 2
        place, speed = place + speed * length + acceleration * length**2 / 2, speed + acceleration * length
    motion = Motion(knots=knots, coefficients=pieces, jumps=knots[1:3])
    bearing = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=5e-3)
    solver = Solver(method=method)  # type: ignore[arg-type]
    history = simulate(Scene(bearing, motion, a_rig(1e4), PLANAR, solver, duration=0.17)).history
    assert {0.1, 0.1 + 1 / 30} <= set(history.time) and history.time[-1] == 0.17
    rows = simulate(Scene(bearing, motion, a_rig(1e4), PLANAR, solver, output_step=0.01)).history.time
    assert rows == pytest.approx(0.01 * np.arange(21), abs=1e-15)


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_stop_displacement_is_found_where_the_motion_has_it(method: str) -> None:
    bearing = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=5e-3)
    solver = Solver(method=method)  # type: ignore[arg-type]
    scene = Scene(bearing, Motion.ramp(0.5, 0.5), a_rig(1e4), PLANAR, solver, stop=Stop(displacement=0.02))
    run = simulate(scene)
    assert run.status == "stopped" and run.history.horizontal[-1] == pytest.approx(0.02, rel=2e-6)
    assert run.history.time[-1] == pytest.approx(np.sqrt(2 * 0.02 / 0.5), rel=1e-3)
