"""Derivatives that a program of a surface forms of its own statements, against difference quotients."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from msfp_gen import Effects, Layout
from msfp_gen.generator.derive import derive
from msfp_gen.generator.functions import in_numpy, to_python
from msfp_gen.generator.program import Program
from msfp_gen.specification.friction_laws import HYSTERESIS
from msfp_gen.specification.layout import ModelSpec

STEP = 1e-6
INPUTS = {
    **{"par_mu": 0.08, "par_R": 1.2, "par_sign": 1.0, "par_dy": 1e-3, "h_Y": 0.3, "h_Z": -0.2, "h_tau": 0.01},
    **{"h_rest": 0.25, "loc_px": 9e3, "loc_py": -4e3, "loc_pz": 1e5, "loc_dwx": 0.11, "loc_dwy": -0.23},
    **{"loc_dwz": 0.07, "g_Y": 0.5, "g_Z": -0.6, "c_mu": 0.07, "h_past": 30.0, "h_gain": 2e-4, "loc_tilt": 0.998},
}


def contact_of(**effects: object) -> Program:
    equations = derive(ModelSpec(Layout(3, 1, 1), Effects(**effects)))  # type: ignore[arg-type]
    return next(program for program in equations.programs if program.name == "contact")


def values(program: Program, held: Mapping[str, float], **changes: float) -> dict[str, float]:
    """The results and statements, with some inputs and statements held and others moved by a difference."""
    known = {f"{use.alias}_{field.name}": 0.7 for use in program.inputs for field in use.block.fields} | INPUTS | held
    known = {name: value + changes.get(name, 0.0) for name, value in known.items()}
    for statement in program.statements:
        name = statement.target.name
        value = held[name] if name in held else eval(to_python(statement.expression), in_numpy(), known)
        known[name] = float(value) + changes.get(name, 0.0)
    return known | {name: float(eval(to_python(e), in_numpy(), known)) for name, e in program.results.items()}


def slope(program: Program, result: str, symbol: str, held: Mapping[str, float]) -> float:
    there, back = (values(program, held, **{symbol: sign * STEP})[result] for sign in (1, -1))
    return (there - back) / (2 * STEP)


@pytest.mark.parametrize("law", HYSTERESIS)
def test_partials_of_the_friction_state_are_those_of_its_rates(law: str) -> None:
    """At constant slip velocity, on which the rates depend too."""
    program = contact_of(bouc_wen=law)
    at = values(program, {})
    for rate in "YZ":
        for name in "YZ":
            found = slope(program, f"d{rate}", str(program.results[name]), {})
            assert at[f"{rate}{name}"] == pytest.approx(found, abs=1e-6), (rate, name)


@pytest.mark.parametrize("law", HYSTERESIS)
def test_partials_of_a_law_of_friction_are_at_constant_force_and_slip(law: str) -> None:
    program = contact_of(bouc_wen=law, friction="pvt")
    at = values(program, {})
    held = {str(program.results[name]): at[name] for name in ("N", "u", "v")}
    for name in ("Y", "Z"):
        assert at[f"law_{name}"] == pytest.approx(slope(program, "mu", f"g_{name}", held), abs=1e-9)
    assert at["law_mu"] == pytest.approx(slope(program, "mu", "c_mu", held), abs=1e-9)
    assert law == "plastic" or min(abs(at[f"law_{name}"]) for name in ("Y", "Z", "mu")) > 1e-6


def test_moment_of_a_rim_with_uplift_is_the_slope_of_its_energy() -> None:
    """The slope of angle over sine, of which the moment consists, is derived: without damping by difference quotients.

    Below a concave-down surface the dish is the body above, whose rotation about the sphere centre does the work.
    """
    equations = derive(ModelSpec(Layout(3, 1, 1), Effects(uplift=True)))
    program = next(program for program in equations.programs if program.name == "rim")
    given = {"par_sign": -1.0, "par_R": 1.2, "par_sc": 0.05, "par_pr": 0.1, "par_kc": 1e7, "par_cc": 0.0}
    given |= {"x_psi": 0.11, "x_theta": -0.23, "x_dx": 0.004, "x_dy": -0.003, "x_dz": 0.002}
    at = values(program, given)
    axes = {"x_psi": (1.0, 0.0, 0.0), "x_theta": (0.0, np.cos(given["x_psi"]), np.sin(given["x_psi"]))}  # (3.12)
    lever = 1 - given["par_pr"] / given["par_R"]
    for angle, axis in axes.items():
        work = -given["par_kc"] * at["g"] * lever * slope(program, "g", angle, given)
        assert np.dot([at["Mx"], at["My"], at["Mz"]], axis) == pytest.approx(work, rel=1e-6), angle
