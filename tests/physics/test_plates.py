"""Heated plates of finite thickness: the sum of exponentials against images and closed forms; runs; refusals."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from reference import friction_laws as reference
from support import Array
from support.friction_scenes import P_REF, RADIUS, heated, lawful

from msfp_gen import Auto, InputError
from msfp_gen.results.result import Result
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.scene.friction_parameters import coefficient, derived_parameters, derived_slopes
from msfp_gen.specification.friction_laws import (
    BUILT_IN,
    HEAT_ERROR,
    HEAT_ONSET,
    LONGEST,
    PLATE_KERNEL,
    PLATE_TEMPERATURE,
    SHORTEST,
    THICK,
    law_of,
)

K, D, START = 18.0, 4.44e-6, 20.0
THIN, USUAL = 2e-3, 20e-3


def summed(tau: Array) -> Array:
    rate, weight = np.array(PLATE_KERNEL).T
    return np.asarray((weight * np.exp(-np.multiply.outer(tau, rate))).sum(-1))


def exact(tau: Array) -> Array:
    """The kernel of a plate of thickness 1 and diffusivity 1, by images."""
    return np.asarray((1 + reference.images(tau, 1.0, 1.0)) / np.sqrt(tau))


def flux_of(run: Result, surface: int) -> Array:
    """Heat flux at the centre of a surface from the recorded friction, force and slip [W/m^2]."""
    rows, R = run.history, run.scene.bearing.surfaces[surface].radius
    assert rows.friction_coefficient is not None
    v = reference.sliding_velocity(rows.friction_state, rows.slip_velocity)[:, surface]
    cover = reference.cover(R * np.sin(rows.sliding[:, surface] / R), RADIUS)
    return rows.friction_coefficient[:, surface] * rows.normal_force[:, surface] / (np.pi * RADIUS**2) * v * cover


def test_the_sum_is_the_kernel_of_images_within_the_bound() -> None:
    rate, weight = np.array(PLATE_KERNEL).T
    shortest = SHORTEST / (THICK * LONGEST)
    tau = np.geomspace(shortest, 20.0, 4000)
    assert np.abs(summed(tau) / exact(tau) - 1).max() < HEAT_ERROR
    assert weight.min() >= 0 and rate[:2] == pytest.approx([0.0, np.pi**2], rel=1e-9)
    late = np.sqrt(np.pi) * (1 + 2 * np.exp(-(np.pi**2) * np.array([1.0, 2.0, 5.0])))  # modes: Poisson's summation
    assert summed(np.array([1.0, 2.0, 5.0])) == pytest.approx(late, rel=1e-9)
    root = np.sqrt(shortest) * (np.arange(20000) + 0.5) / 20000  # integrals over the root of the time have no pole
    onset = 1 - root * summed(root**2)
    assert onset.sum() == pytest.approx(0.0, abs=20)  # the integral over the first instants is exact, to 1e-3
    assert np.abs(onset).sum() * np.sqrt(SHORTEST) / 20000 < HEAT_ONSET  # of the thickest plate; less of others


@pytest.mark.parametrize("thickness", [THIN, USUAL])
def test_temperature_of_a_run_is_that_of_the_flux_and_its_images(thickness: float) -> None:
    run = heated(thickness)
    found, flux = run.history.temperature, flux_of(run, 0)
    assert found is not None
    time = run.history.time
    rows = np.arange(len(time) // 40, len(time), len(time) // 40)
    added = reference.image_temperature(time, flux, K, D, thickness, rows)
    want = reference.temperature(time, flux, K, D, START, rows) + added
    onset = np.sqrt(D / np.pi) / K * reference.change_within(time, flux, SHORTEST)[rows]
    error = np.abs(found[rows, 0] - want)
    assert (error <= HEAT_ERROR * (want - START) + HEAT_ONSET * onset + 3e-4 * (want.max() - START)).all()
    if thickness == THIN:
        assert added.max() > 10 * error.max(), "the back face would not be seen"


def test_heat_stays_in_a_plate_and_spreads_evenly() -> None:
    """At rest the surface tends to the mean of the plate, which has risen by q t/(rho c d)."""
    run = heated(THIN, hold=2.0)
    temperature = run.history.temperature
    assert temperature is not None
    for surface in (0, 3):
        heat = np.trapezoid(flux_of(run, surface), run.history.time)  # [J/m^2]
        mean = START + heat * D / (K * THIN)
        assert temperature[:, surface].max() - mean > 5
        assert temperature[-1, surface] == pytest.approx(mean, abs=2e-3 * (mean - START))


def test_a_thick_plate_is_a_half_space() -> None:
    half, thick = heated().history.temperature, heated(0.3).history.temperature
    assert half is not None and thick is not None
    at = np.linspace(0, heated().history.time[-1], 400)
    apart = np.interp(at, heated().history.time, half[:, 0]) - np.interp(at, heated(0.3).history.time, thick[:, 0])
    assert np.abs(apart).max() < 2 * HEAT_ERROR * (half.max() - START)
    limit = (THICK * D * LONGEST) ** 0.5
    assert 2 * np.exp(-THICK) <= HEAT_ERROR * 1.02  # images at LONGEST
    assert numbers(limit) == pytest.approx(numbers(10.0), rel=1e-12) and numbers(0.9 * limit) != numbers(limit)


def numbers(thickness: float) -> list[float]:
    derived = derived_parameters({"conductivity": K, "diffusivity": D, "plate_thickness": thickness})
    return [derived["plate_rate"], derived["plate_heating"]]


@pytest.mark.parametrize("name", ["plate_thickness", "diffusivity", "conductivity"])
@pytest.mark.parametrize("thickness", [USUAL, 0.5])
def test_slopes_of_the_numbers_of_a_plate(name: str, thickness: float) -> None:
    values = {"conductivity": K, "diffusivity": D, "plate_thickness": thickness}
    slopes = derived_slopes(values, name)
    for key in ("plate_rate", "plate_heating"):
        above, below = (derived_parameters(values | {name: values[name] * f})[key] for f in (1 + 1e-6, 1 - 1e-6))
        want = (above - below) / (2e-6 * values[name])
        assert slopes.get(key, 0.0) == pytest.approx(want, rel=1e-6, abs=1e-9 * numbers(thickness)[0] / values[name])


def test_the_thickness_selects_the_law_and_is_refused_without_it() -> None:
    scene = heated(USUAL).scene
    auto = replace(scene, effects=Auto(dimension="planar", uplift=False))
    assert auto.modelled.friction == "pvtd"
    with pytest.raises(InputError, match=r"plate_thickness = 0\.02 .*'pvt' has no such parameter.*give 'pvtd'"):
        replace(scene, effects=replace(scene.effects, friction="pvt"))
    with pytest.raises(InputError, match=r"plate_thickness is missing \(surface 1\)"):
        lawful(scene, "pvtd", plate_thickness=None)
    with pytest.raises(InputError, match=r"plate_thickness = 0"):
        lawful(scene, "pvtd", plate_thickness=0.0)
    assert scene.with_effects(friction="pvt").bearing.surfaces[0].plate_thickness is None


def test_scenes_with_plates_come_back() -> None:
    scene = heated(USUAL).scene
    assert "plate_thickness" in scene_text(scene)
    back = scene_from_table(tomllib.loads(scene_text(scene)))
    assert back.bearing == scene.bearing and back.effects == scene.effects


def test_a_formula_may_contain_the_temperature_of_a_plate() -> None:
    pvtd = BUILT_IN["pvtd"]
    law = law_of("custom", "mu * (0.7 ** (Td / c1) + 0.4) / (0.7 ** 0.4 + 0.4)")
    assert law is not None and law.memory is PLATE_TEMPERATURE and law.depends_on_temperature
    assert set(law.columns) == {"c1", "area", *PLATE_TEMPERATURE.values} and "plate_thickness" in law.parameters
    given = {"mu": 0.06, "Td": 150.0, "v": 0.1, "p": P_REF, "reference_pressure": P_REF, "velocity_rate": 1.0}
    neutral = {"pressure_ratio": 1.0, "velocity_drop": 0.0, "temperature_ratio": 0.7}
    want = coefficient(pvtd, given | neutral)[0]
    assert coefficient(law, {"mu": 0.06, "Td": 150.0, "c1": 50.0})[0] == pytest.approx(float(want), rel=1e-12)
