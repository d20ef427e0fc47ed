"""Heated plates of finite thickness: the sum of exponentials against images and closed forms; runs; refusals."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from reference import friction_laws as reference
from scipy.special import erfc
from support import ROOT, Array, scene_of
from support.friction_scenes import P_REF, RADIUS, heated, lawful

from msfp_gen import Auto, Bearing, Effects, InputError, Motion, Scene, Top, load_scene, simulate, temperature_at_depth
from msfp_gen.results.depth import rise_inside
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


def flux_of(run: Result, surface: int, radius: float = RADIUS) -> Array:
    """Heat flux at the centre of a surface from the recorded friction, force and slip [W/m^2]."""
    rows, R = run.history, run.scene.bearing.surfaces[surface].radius
    assert rows.friction_coefficient is not None
    v = reference.sliding_velocity(rows.friction_state, rows.slip_velocity)[:, surface]
    cover = reference.cover(R * np.sin(rows.sliding[:, surface] / R), radius)
    return rows.friction_coefficient[:, surface] * rows.normal_force[:, surface] / (np.pi * radius**2) * v * cover


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


def test_temperature_at_a_depth_is_the_closed_form_of_a_step() -> None:
    """Of the surface: erfc in a half-space, the series of a plate, which fills up evenly."""
    time = np.r_[0.0, 1e-6, np.linspace(0.02, 40.0, 1000)]
    rise = np.r_[0.0, np.full(1001, 100.0)]  # within a microsecond
    later = time > 0.5
    for depth in (1e-3, 4e-3, 15e-3):
        want = 100 * erfc(depth / (2 * np.sqrt(D * time[later])))
        assert rise_inside(time, rise, depth, D, np.inf)[later] == pytest.approx(want, abs=0.05)
    plate = rise_inside(time, rise, 5e-3, D, 5e-3)  # at the back face: twice erfc at first, in the end one mode
    early = later & (time < 1.5)
    assert plate[early] == pytest.approx(200 * erfc(5e-3 / (2 * np.sqrt(D * time[early]))), abs=0.05)
    late = time > 10
    mode = 4 / np.pi * np.exp(-D * (np.pi / 10e-3) ** 2 * time[late])
    assert plate[late] == pytest.approx(100 * (1 - mode), abs=0.05)


def test_temperature_at_a_depth_of_a_run_is_that_of_its_flux() -> None:
    """From the surface on, or from the flux: the kernel at a depth, by images."""
    run = heated(THIN, hold=2.0)
    time, flux = run.history.time, flux_of(run, 0)
    depth = 0.4e-3
    found = temperature_at_depth(run, depth)
    assert found.shape == (len(time), 4)
    for i in range(len(time) // 5, len(time), len(time) // 5):
        tau = time[i] - time[:i]
        sources = np.arange(-6, 7) * 2 * THIN + depth
        kernel = np.exp(-np.multiply.outer(1 / (4 * D * tau), sources**2)).sum(-1) / np.sqrt(tau)
        want = START + np.sqrt(D / np.pi) / K * np.trapezoid(flux[: i + 1] * np.append(kernel, 0.0), time[: i + 1])
        assert found[i, 0] == pytest.approx(want, abs=4e-3 * (want - START) + 0.05)
    surface = run.history.temperature
    assert surface is not None and 2 < (surface.max(0) - found.max(0))[0] < surface.max() - START
    with pytest.raises(InputError, match=r"depth = 0\.003: the plate of surface 1 ends at plate_thickness = 0\.002"):
        temperature_at_depth(run, 3e-3)
    with pytest.raises(InputError, match=r"this run has no temperatures"):
        temperature_at_depth(simulate(scene_of("fenz-test2", {"dimension": "planar"}, duration=0.1)), 1e-3)


# Configuration A of Kim and Constantinou (2023), in the manual of OpenSees' TripleFrictionPendulumX: temperatures
# [degC] of surfaces 1 and 4 at 5, 15, 25, 35, 50 s, digitised to 2 degC, of half-spaces and of plates of 20 mm.
MANUAL_TIMES = [5.0, 15.0, 25.0, 35.0, 50.0]
MANUAL = {
    (0, 0.0): [98.5, 140.0, 168.0, 182.0, 201.0],
    (0, USUAL): [99.0, 139.0, 163.0, 185.0, 210.0],
    (3, 0.0): [125.0, 185.0, 227.0, 252.0, 280.0],
    (3, USUAL): [120.0, 182.0, 220.0, 253.0, 292.0],
}


@cache
def configuration_a(thickness: float) -> Result:
    """Ten cycles of 600 mm in 5 s under 13,345 kN; heights of sliders are not published."""
    lengths, limits, height = (3.7465, 0.3937), (0.5043, 0.0716), (0.3, 0.15)
    diameters, load = np.array([0.711, 0.508, 0.508, 0.711]), 13345e3
    bearing = Bearing.from_sheet(
        device="triple", effective_radius=lengths, height=height, friction=(0.04, 0.01, 0.01, 0.08), axial_load=load,
        capacity=[d * (L + h) / L for d, L, h in zip(limits, lengths, height, strict=True)],
        slider_diameter=(0.711, 0.508),
    )  # fmt: skip
    bearing = bearing.replace(
        friction=[0.04, 0.01, 0.01, 0.08],
        yield_displacement=1e-3,
        velocity_rate=100.0,
        patch_radius=diameters / 2,
        reference_pressure=load / (np.pi * diameters**2 / 4),
        plate_thickness=thickness or None,
    )
    level = {"rotational_stiffness": 1e10, "rotational_damping": 1e6}
    top = Top.rig(axial_load=load, stiffness=1e10, damping=1e6, **level)
    effects = Effects(friction="pvtd" if thickness else "pvt", dimension="planar")
    return simulate(Scene(bearing, Motion.harmonic(0.6, 0.2, cycles=10), top, effects=effects, output_step=5e-3))


def heat_by_rectangles(time: Array, flux: Array, step: float, at: Array) -> Array:
    """The rise as the element sums it: the flux of every step over the root of its age at the far end of the step."""
    grid = np.arange(round(time[-1] / step) + 1) * step
    flux = np.interp(grid, time, flux)
    ends = np.rint(at / step).astype(int)
    factor = np.sqrt(D / np.pi) / K
    return np.array([factor * (flux[i::-1] * step / np.sqrt((np.arange(i + 1) + 1) * step)).sum() for i in ends])


@pytest.mark.slow
@pytest.mark.parametrize("surface", [0, 3])
def test_configuration_a_of_another_element(surface: int) -> None:
    """Summed as the element does, our flux gives its temperatures; the exact integral is up to 9 degC above them.

    The element leaves out the singular end of the integral, 1.46 sqrt(step) times the present flux: most at the start,
    where friction has not fallen yet.
    """
    half, plate = configuration_a(0.0), configuration_a(USUAL)
    at, manual = np.array(MANUAL_TIMES), np.array(MANUAL[surface, 0.0])
    found = [np.interp(at, run.history.time, run.history.temperature[:, surface]) for run in (half, plate)]  # type: ignore[index]
    flux = flux_of(half, surface, half.scene.bearing.surfaces[surface].patch_radius or 0.0)
    summed = START + heat_by_rectangles(half.history.time, flux, 0.01, at)
    assert np.abs(summed - manual).max() < 6.0
    assert (found[0] > summed).all() and np.abs(found[0] - manual).max() < 10.0
    # What the back face adds does not depend on how the newest flux is summed.
    added = found[1] - found[0]
    of_manual = np.array(MANUAL[surface, USUAL]) - manual
    assert added[-1] == pytest.approx(of_manual[-1], abs=4.0) and added[-1] > 5.0
    assert np.abs(added[:2]).max() < 0.5


@pytest.mark.slow
def test_temperatures_of_the_page() -> None:
    """Of the dish of `examples/heating.toml` after 20 s, in plates of the thicknesses that docs/friction.md names."""
    page = " ".join((ROOT / "docs" / "friction.md").read_text(encoding="utf-8").split())
    scene = load_scene(ROOT / "examples" / "heating.toml")
    found = []
    for thickness in (None, 0.02, 0.01, 0.005):
        bearing = scene.bearing.replace(**({} if thickness is None else {"plate_thickness": thickness}))
        law = "pvt" if thickness is None else "pvtd"
        run = simulate(replace(scene, bearing=bearing, effects=replace(scene.effects, friction=law)))
        assert run.history.temperature is not None
        found.append(f"{run.history.temperature[-1, 0]:.1f}")
    half, *plates = found
    assert f"the dish ends at {plates[0]} instead of {half} °C after 20 s" in page
    assert f"With 10 mm it is {plates[1]} °C, with 5 mm {plates[2]} °C" in page
