"""Manufactured solutions (docs/verification.md): the error of every method against a motion that is known.

The loads that cause the motion come from the emitted equations; that these are those of the report is checked here
against the reference in plain vectors, and in test_equations.py.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from reference import stack as reference
from reference import top as reference_top
from reference.kinematics import State
from support.manufactured import KNOTS, Solution, fixed_steps, orders, resolved, run, solve
from support.manufactured_cases import KNEES, ORDERS, knees, quasistatic, resolvable, smooth, storey_orders

QUICK = ("spatial",)
REDUCED = {"esdirk4": (1.5, 2.2)}  # of the temperature, whose fastest parts take 0.2 ms: the order of a stage


@cache
def solution(name: str) -> Solution:
    return solve(smooth()[name])


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in smooth()]
)
def test_every_method_has_its_order(name: str) -> None:
    case = smooth()[name]
    for method, counts in case.steps.items():
        found = fixed_steps(case, solution(name), method, counts)
        assert all(size < 1e-2 for size in found[0].values())
        for quantity, order in orders(found, counts).items():
            if quantity == "temperature" and method in REDUCED:
                assert REDUCED[method][0] < order < REDUCED[method][1]
            else:
                assert order == pytest.approx(ORDERS[method], abs=0.2), f"{method}, {quantity}"


def test_the_grid_has_every_effect() -> None:
    """Each value of each field of `Effects` that changes the equations, and each kind of top."""
    from msfp_gen.specification.friction_laws import FRICTION, HYSTERESIS

    cases = [*smooth().values(), *quasistatic().values()]
    have = {(name, value) for case in cases for name, value in vars(case.effects).items()}
    want = {
        *(("friction", word) for word in FRICTION),
        *(("bouc_wen", word) for word in HYSTERESIS),
        *((name, value) for name in ("rims", "uplift", "top_rotation") for value in (False, True)),
        *(("spin", word) for word in ("locked", "patch", "free")),
        *(("sliders", word) for word in ("inertial", "massless")),
        *(("dimension", word) for word in ("planar", "spatial")),
    }
    assert want <= have
    assert {case.top.kind for case in cases} == {"rig", "mass"}


@pytest.mark.parametrize("name", ["spatial", pytest.param("rims", marks=pytest.mark.slow)])
def test_the_loads_are_those_of_the_report_in_plain_vectors(name: str) -> None:
    """At the loads found, the reference has the accelerations of the path."""
    case, found = smooth()[name], solution(name)
    for knot in (1, KNOTS // 2, KNOTS - 2):
        q, v, a = case.coordinates(found.time[knot])
        extra = found.load[1][knot, :, 0] - np.array([0, 0, -case.top.axial_load, 0, 0, 0])

        def load(turn, at, extra=extra):
            held = reference_top.rig(case.top, 0.0, turn, at)
            return replace(held, force=held.force + extra[:3], moment=held.moment + extra[3:])

        solved = reference.solve(
            case.bearing, State(q, v, 0 * a), found.states["f"][knot], load, "locked", case.effects.rims
        )
        assert np.abs(solved.acceleration - a).max() < 1e-8 * np.abs(a).max()


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) for name in resolvable()])
def test_order_on_four_surfaces(name: str) -> None:
    case, push = resolvable()[name]
    for method, counts in case.steps.items():
        found = fixed_steps(case, resolved(case, push), method, counts)
        for quantity, order in orders(found, counts).items():
            assert order == pytest.approx(ORDERS[method], abs=0.3 if method == "dopri5" else 0.2), (
                f"{method}, {quantity}"
            )


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) for name in knees()])
def test_a_kink_leaves_order_two(name: str) -> None:
    """Of the angles; the order of single errors varies, since a step meets the kink anywhere."""
    case, push = knees()[name]
    exact = resolved(case, push)
    for method in case.steps:
        counts = KNEES[method]
        found = fixed_steps(case, exact, method, counts, last=True)
        assert orders(found, counts)["angles"] > 1.6, method
        assert found[-1]["angles"] < 2e-5


@pytest.mark.slow
def test_quasistatic_steps_are_exact_without_rates_and_of_order_two_with_dampers() -> None:
    plain, damped = quasistatic().values()
    exact = solve(plain)
    for steps in (40, 80, 160):
        last = plain.model.unpack(run(plain, exact, "implicit", steps, 1e-12, quasistatic=True).rows[-1])
        assert np.abs(last["q"] - exact.states["q"][-1]).max() < 1e-11
        assert np.abs(last["f"] - exact.states["f"][-1]).max() < 1e-11
    counts = (80, 160, 320)
    found = fixed_steps(damped, solve(damped), "implicit", counts, last=True, quasistatic=True)
    assert orders(found, counts) == {name: pytest.approx(2, abs=0.2) for name in ("angles", "friction")}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_order_of_a_building(method: str) -> None:
    assert storey_orders(method)[1] == pytest.approx(ORDERS[method], abs=0.2)
