"""Laws of friction together with the other effects, and with what reads a run: bounds, characterisation, figures."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reference import friction_laws as reference
from support import ROOT, scene_of, thinned
from support.flights import shaken
from support.friction_scenes import FORMULA, LAWS, P_REF, VALUES, heated, lawful
from support.resuming import assert_same, interrupted

from msfp_gen import Auto, Effects, InputError, Scene, Surface, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.common.fields import Quantity, ruled_fields
from msfp_gen.results.geometry import friction_circles, poses
from msfp_gen.results.result import Result
from msfp_gen.scene.file.loader import scene_from_table
from msfp_gen.simulation import bearing_run as simulation
from msfp_gen.specification.formula import FUNCTIONS
from msfp_gen.specification.friction_laws import BUILT_IN, HEAT_KERNEL, VARIABLES, law_parameter_names
from msfp_gen.studies.bounding import bounded_scenes, load_factors

EXAMPLE, PAGE = ROOT / "examples" / "heating.toml", ROOT / "docs" / "friction.md"
BOUNDS = 'rule = "asce7"\n[[factor]]\nproperty = "friction"\nsurfaces = [1, 4]\ndirect = { test = [0.8, 1.5] }\n'


def under(word: str, **effects: Any) -> Scene:
    """The report's test 2 under a law, in the plane of its motion."""
    return lawful(
        scene_of("fenz-test2", {"dimension": "planar", **effects}), word, LAWS[word].get("friction_law"), **VALUES[word]
    )


@cache
def run_under(word: str) -> Result:
    return simulate(under(word))


# ---- effects --------------------------------------------------------------------------------------------------------


UPLIFT = Effects(dimension="planar", uplift=True, bouc_wen="report")  # the law of the reference of heat below


@cache
def flight(word: str, **values: Any) -> Result:
    """With steps so short that rows at their ends give the flux of heat between them, too."""
    scene = lawful(shaken(1.4, sideways=0.03, duration=1.0, effects=UPLIFT), word, **values)
    return simulate(replace(scene, solver=replace(scene.solver, rtol=1e-5)))


@pytest.mark.slow
def test_flights_under_a_law() -> None:
    """What parts, and when, is a matter of the vertical motion; energy closes; what is open does not heat."""
    plain, hot = flight("constant"), flight("pvt", reference_pressure=10e6)
    assert hot.succeeded and {event.kind for event in hot.events} >= {"lift_off", "landing"}
    assert hot.summary["energy"]["closure_error"] < 1e-3
    first = [next(event.time for event in run.events if event.kind == "lift_off") for run in (plain, hot)]
    assert first[0] == pytest.approx(first[1], abs=2e-3)
    rows, surface = hot.history, hot.scene.bearing.surfaces[3]
    assert rows.temperature is not None
    patch = hot.scene.bearing.slider_rim_radius(3)
    away = surface.radius * np.sin(rows.sliding[:, 3] / surface.radius)
    v = reference.sliding_velocity(rows.friction_state, rows.slip_velocity)[:, 3]
    p = rows.normal_force[:, 3] / (np.pi * patch**2)
    flux = hot.friction_coefficient[:, 3] * p * v * reference.cover(away, patch)
    open_ = rows.lift[:, 3] > 1e-6
    assert open_.sum() > 100 and flux[open_].max() < 1e-3 * flux.max()
    want = reference.temperature_by_states(rows.time, flux, 18.0, 4.44e-6, 20.0, HEAT_KERNEL)
    assert np.abs(rows.temperature[:, 3] - want).max() < 2e-3 * (want.max() - 20.0)


@pytest.mark.slow
@pytest.mark.parametrize("word", thinned(LAWS, lambda word: word != "velocity"))
def test_sliders_without_mass(word: str) -> None:
    """A slow test: inertia is nothing, and so the law sees the same."""
    massless, inertial = simulate(under(word, sliders="massless")), run_under(word)
    assert massless.succeeded and massless.summary["energy"]["closure_error"] < 1e-3
    for name in ("least_friction", "most_friction"):
        assert massless.summary[name] == pytest.approx(inertial.summary[name], rel=2e-3)
    force = [run.summary["peak_force"]["radial"] for run in (massless, inertial)]
    assert force[0] == pytest.approx(force[1], rel=1e-3)


@pytest.mark.parametrize("uplift", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_run_that_heats_goes_on_from_its_checkpoint(
    uplift: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every exponential state is in the file: the same rows, bit by bit."""
    monkeypatch.setattr(simulation, "STEPS_PER_CALL", 20)
    scene = replace(under("pvt", uplift=uplift), output_step=0.05)
    scene = replace(scene, duration=8.0)
    whole = simulate(scene)
    part = interrupted(scene, tmp_path / "run.ck", 4.0)
    assert part.history.temperature is not None and part.history.temperature.max() > 20.2
    assert_same(whole, simulate(scene, checkpoint=tmp_path / "run.ck", resume=True))


@pytest.mark.slow
def test_heat_is_taken_in_on_the_way() -> None:
    """Left to be chosen, the run begins with pv and goes on with pvt once heat matters: the same temperatures."""
    scene = replace(load_scene(EXAMPLE), duration=5.0)
    given, chosen = simulate(scene), simulate(replace(scene, effects=Auto(dimension="planar")))
    (heat,) = (note for note in chosen.notes if note.kind == "heat")
    assert heat.action == "friction = pvt" and heat.time < 0.2
    a, b = given.history, chosen.history
    assert a.temperature is not None and b.temperature is not None
    rise = np.interp(a.time, b.time, b.temperature[:, 0]) - a.temperature[:, 0]
    cold = a.time <= heat.time  # rows of pv, at the temperature of the start
    assert np.abs(rise[~cold]).max() < 1e-3 * np.ptp(a.temperature[:, 0])
    assert np.all(b.temperature[b.time <= heat.time] == 20.0) and np.abs(rise[cold]).max() < 1.2
    assert chosen.summary["energy"]["closure_error"] < 1e-3


# ---- what reads a run -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("word", thinned(LAWS, lambda word: word != "velocity"))
def test_heat_of_the_surfaces_is_the_energy_that_friction_loses(word: str) -> None:
    """And a little more: the heat that engineers sign off counts elastic slip as well (docs/results.md)."""
    run = run_under(word)
    uses = run.characterise().surfaces
    area = [np.pi * run.scene.bearing.slider_rim_radius(i) ** 2 for i in range(4)]
    assert [use.contact_area for use in uses] == pytest.approx(area)
    heat = sum(use.heat * use.contact_area for use in uses if use.heat is not None and use.contact_area is not None)
    assert 1.0 < heat / run.history.energy["friction_dissipated"][-1] < 1.05


def test_heat_comes_through_the_patch() -> None:
    wide, narrow = (
        simulate(
            lawful(
                scene_of("fenz-test2", {"dimension": "planar"}),
                "pvt",
                reference_pressure=P_REF,
                pressure_ratio=1.0,
                temperature_ratio=1.0,
                patch_radius=r,
            )
        )
        .characterise()
        .surfaces[0]
        for r in (0.05, 0.025)
    )
    assert wide.peak_heat_flux is not None and narrow.peak_heat_flux is not None
    assert narrow.peak_heat_flux == pytest.approx(4 * wide.peak_heat_flux, rel=1e-2)


@pytest.mark.parametrize("word", thinned(LAWS, lambda word: word != "velocity"))
def test_bounds_multiply_the_whole_law(word: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(BOUNDS, encoding="utf-8")
    scenes = bounded_scenes(under(word), load_factors(tmp_path / "mine.toml"))
    nominal, upper = (scenes[case].bearing.surfaces for case in ("nominal", "upper"))
    for name in ("friction", "friction_slow") if word == "velocity" else ("friction",):
        ratio = [getattr(b, name) / getattr(a, name) for a, b in zip(nominal, upper, strict=True)]
        assert ratio == pytest.approx([1.5, 1, 1, 1.5])
    model_friction = simulate(replace(scenes["upper"], duration=20.0)).summary["most_friction"]
    assert model_friction[3] == pytest.approx(1.5 * run_under(word).summary["most_friction"][3], rel=0.05)


def test_bounds_refuse_a_law_that_does_not_follow_friction(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(BOUNDS, encoding="utf-8")
    scene = lawful(scene_of("fenz-test2"), "custom", "mu + c1 * exp(-c2 * v)", c1=0.01, c2=20.0)
    with pytest.raises(InputError, match=r"friction_law = .*not proportional.*mu \* "):
        bounded_scenes(scene, load_factors(tmp_path / "mine.toml"))


def test_force_line_touches_the_circle_of_the_friction_of_that_instant() -> None:
    run = heated()
    where, circles = poses(run), friction_circles(run)
    distance = np.linalg.norm(where.line - where.centre, axis=-1)
    slides = ((run.history.friction_state**2).sum(-1) > 0.999999) & (run.history.rim_force == 0)
    assert slides.sum() > 1000
    assert distance[slides] == pytest.approx(circles[slides], rel=1e-6)
    assert np.ptp(circles, axis=0).max() > 0.2 * circles.max(), "this would not see the law"


@pytest.mark.slow
def test_summary_and_tables_show_friction_and_temperature(capsys: pytest.CaptureFixture[str]) -> None:
    run = simulate(replace(load_scene(EXAMPLE), duration=3.0))
    assert run.summary["peak_temperature"][0] > 100.0
    mu = [run.summary[name][0] for name in ("least_friction", "most_friction")]
    assert 0.0 < mu[0] < mu[1] < 0.06
    cold = simulate(scene_of("fenz-test2", duration=1.0))
    assert not {"least_friction", "peak_temperature"} & set(cold.summary)
    assert main(["run", str(EXAMPLE), "--duration", "3"]) == 0
    out = capsys.readouterr().out
    assert "least mu" in out and "peak T [degC]" in out and f"{run.summary['peak_temperature'][0]:.1f}" in out


def test_explain_shows_the_law_and_its_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(EXAMPLE)]) == 0
    out = capsys.readouterr().out
    for words in (
        "(Kumar et al. 2015)",
        "mu * pressure_ratio **",
        "friction law, surfaces bottom first",
        "reference_pressure [Pa]",
        "4.42e+07",
        "conductivity [W/(m K)]",
        "start_temperature [degC]",
        "0.7",
    ):
        assert words in out, words


@pytest.mark.parametrize(
    ("given", "effects"),
    [
        (["--friction", "velocity"], Effects(friction="velocity")),
        (["--friction", "pvt", "--dimension", "planar"], Effects(friction="pvt", dimension="planar")),
        (["--friction", "custom", "--friction-law", FORMULA], Effects(friction="custom", friction_law=FORMULA)),
    ],
)
def test_models_are_generated_with_a_law(given: list[str], effects: Effects, monkeypatch: pytest.MonkeyPatch) -> None:
    specs: list[Any] = []

    def prepare(spec: Any, _: Any) -> Any:
        specs.append(spec)
        raise InputError("enough")

    monkeypatch.setattr("msfp_gen.jit.build.prepare", prepare)
    assert main(["generate", "5", "2", "2", *given]) == 2
    assert [spec.effects for spec in specs] == [effects]


def test_page_names_every_number_and_name() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in {*law_parameter_names(), *VARIABLES, *FUNCTIONS} - {"c2", "c3"}:
        assert f"`{name}`" in text, name
    units = {name: rule.unit for name, rule, _ in ruled_fields(Surface) if isinstance(rule, Quantity)}
    for law in BUILT_IN.values():
        for name, default in law.parameters.items():
            rows = re.findall(rf"^\| `{name}` \|.*\| (.*) \| (.*) \|$", text, re.MULTILINE)
            shown = {(unit.replace("°C", "degC").replace("²", "^2"), value) for unit, value in rows}
            assert (units[name] or "-", f"{default:g}" if default is not None else None) in {
                (unit, f"{float(value):g}" if value[0].isdigit() else None) for unit, value in shown
            } or name == "patch_radius", name


@pytest.mark.slow
def test_blocks_of_the_page_run() -> None:
    blocks = dict(re.findall(r"```(toml|python)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))
    rig = {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8, "damping": 5.0}
    motion = {"kind": "harmonic", "amplitude": 0.02, "frequency": 0.5}
    scene = scene_from_table({**tomllib.loads(blocks["toml"]), "motion": motion, "top": rig})
    law = scene.modelled.law
    assert law is not None and law.word == "custom" and not law.depends_on_temperature
    assert [surface.c3 for surface in scene.bearing.surfaces] == [2e-8, 1e-8, 1e-8, 2e-8]
    names: dict[str, Any] = {}
    exec(compile(blocks["python"], str(PAGE), "exec"), names)  # a block of our own documentation
    assert names["run"].history.friction_coefficient.shape[1] == 4


def test_a_formula_that_cannot_be_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["generate", "5", "2", "2", "--friction", "custom", "--friction-law", "mu * sin(v)"]) == 2
    assert capsys.readouterr().err.startswith("error: effects.friction_law = 'mu * sin(v)': 'sin' is no function")
