"""Characterisation: made-up loops with exact answers, closed forms of the friction circle, and runs of the report."""

from __future__ import annotations

import csv
import dataclasses
import json
from functools import cache
from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
import pytest
from reference.friction_circle import Push, force_at
from reference.friction_circle import transitions as closed_transitions
from reference.parameters import fenz
from support import Array, preset_run, scene_of
from support.synthetic import LOAD, history, loops, ramp, scene

from msfp_gen import Bearing, Body, Effects, InputError, Layout, Motion, Scene, Solver, Surface, Top, simulate
from msfp_gen.cli import main
from msfp_gen.common.tables import Table
from msfp_gen.results.characterise import Characterisation, characterise
from msfp_gen.results.loops import closed_cycles, loop_area, turning_points
from msfp_gen.results.result import Result

D, YIELD, SLOPE, STRENGTH = 0.05, 2e-3, 2e5, 9e3  # a bilinear loop: amplitude, yield displacement, k_d, Q


def bilinear(ends: tuple[float, ...] = (0, D, -D, D, -D, D), rim_radius: float = 0.05, rows: int = 500) -> Result:
    """A single pendulum that is elastic-plastic plus a spring, along straight ways between `ends`, one a second."""
    u = np.concatenate([np.linspace(a, b, rows, endpoint=False) for a, b in pairwise(ends)])
    u = np.append(u, ends[-1])
    spring = np.zeros_like(u)
    for i in range(1, len(u)):
        spring[i] = np.clip(spring[i - 1] + (u[i] - u[i - 1]) / YIELD, -1, 1)
    vector = np.stack([u, 0 * u, 0 * u], axis=1)
    force = np.stack([SLOPE * u + STRENGTH * spring, 0 * u, 0 * u], axis=1)
    made = history(vector, force, np.abs(u)[:, None], (1.0,), duration=len(ends) - 1.0)
    tilt, state = np.zeros((len(u), 1, 3)), np.zeros((len(u), 1, 2))
    tilt[:, 0, 1], state[:, 0, 0] = u / 10, -spring
    speed = np.zeros((len(u), 1, 2))
    speed[:, 0, 0] = -np.gradient(u, made.time)
    made = dataclasses.replace(made, tilt_angles=tilt, friction_state=state, slip_velocity=speed)
    plain = scene(capacities=(1.0,))
    bearing = plain.bearing.replace(yield_displacement=YIELD, rim_radius=rim_radius)
    return Result(dataclasses.replace(plain, bearing=bearing), made)


def test_bilinear_loop_is_exact() -> None:
    found = characterise(bilinear())
    assert found.kind == "cycles" and found.direction == (1.0, 0.0) and len(found.cycles) == 2
    stiffness, energy = SLOPE + STRENGTH / D, 4 * STRENGTH * (D - YIELD)
    for cycle in found.cycles:
        loop = cycle.loop
        assert (loop.displacement_most, loop.displacement_least) == (D, -D)
        assert loop.effective_stiffness == pytest.approx(stiffness, rel=1e-12)
        assert loop.energy_dissipated == pytest.approx(energy, rel=1e-12)
        assert loop.effective_damping == pytest.approx(energy / (2 * pi * stiffness * D**2), rel=1e-12)
        assert loop.zero_displacement_force == pytest.approx(STRENGTH, rel=1e-12)
        assert cycle.effective_period == pytest.approx(2 * pi * np.sqrt(LOAD / 9.8 / stiffness))
        assert cycle.stage_stiffness() == {(1,): pytest.approx(SLOPE, rel=1e-9)}
    for name, value in (("effective_stiffness", stiffness), ("energy_dissipated", energy)):
        assert dataclasses.astuple(found.envelope[name]) == pytest.approx((value,) * 3)


def test_bilinear_stages_are_exact() -> None:
    """Stuck over twice the yield displacement on the way back, then a line of slope k_d through -Q."""
    back = characterise(bilinear()).cycles[0].branches[0]
    assert [stage.surfaces for stage in back.stages] == [(), (1,)]
    stuck, slides = back.stages
    cell = 2 * D / 400
    assert (stuck.start, slides.end) == (D, -D) and stuck.end == pytest.approx(D - 2 * YIELD, abs=3 * cell)
    assert stuck.stiffness == pytest.approx(SLOPE + STRENGTH / YIELD, rel=1e-9)
    assert (slides.stiffness, slides.intercept) == pytest.approx((SLOPE, -STRENGTH), rel=1e-9)
    assert max(stuck.scatter, slides.scatter) < 1e-6 * STRENGTH
    (change,) = back.transitions
    assert (change.before, change.after) == ((), (1,))
    assert change.displacement == pytest.approx(D - 2 * YIELD, abs=3 * cell)


def test_first_way_out_is_the_backbone() -> None:
    first = characterise(bilinear()).first_loading
    assert first is not None and (first.start, first.end) == (0, D)
    assert first.stages[-1].stiffness == pytest.approx(SLOPE, rel=1e-9)
    assert first.stages[-1].intercept == pytest.approx(STRENGTH, rel=1e-9)


def test_outliers_do_not_bend_the_line_of_a_stage() -> None:
    run = bilinear()
    force = run.history.top_force.copy()
    force[1200:1205, 0] += 5 * STRENGTH  # an impact in the middle of the second way
    spiked = dataclasses.replace(run, history=dataclasses.replace(run.history, top_force=force))
    (stage,) = (s for s in characterise(spiked).cycles[0].branches[1].stages if s.surfaces)
    assert stage.stiffness == pytest.approx(SLOPE, rel=1e-3)
    assert stage.scatter > STRENGTH


def test_velocity_heat_and_capacity_by_hand() -> None:
    """2 D a second over a patch of 50 mm: q = mu N v/(pi r^2), heat the same over the path."""
    run = bilinear((0, D, -D))
    (use,) = characterise(run).surfaces
    area = pi * 0.05**2
    assert use.contact_area == pytest.approx(area)
    assert use.capacity_left == pytest.approx(1.0 - D) and use.capacity_left_share == pytest.approx(1.0 - D)
    assert use.peak_velocity == pytest.approx(2 * D, rel=1e-9)
    assert use.peak_heat_flux == pytest.approx(0.05 * LOAD * 2 * D / area, rel=1e-9)
    assert use.heat == pytest.approx(0.05 * LOAD * 3 * D / area, rel=1e-2)


def test_uplift_is_read_where_the_run_has_it() -> None:
    run = bilinear()
    assert characterise(run).maximum_uplift is None
    effects = dataclasses.replace(run.scene.effects, uplift=True)
    run = dataclasses.replace(run, scene=dataclasses.replace(run.scene, effects=effects))
    lift = np.zeros((len(run.history.time), 1))
    lift[7] = 0.004
    object.__setattr__(run.history, "lift", lift)
    found = characterise(run)
    assert found.maximum_uplift == 0.004 and found.surfaces[0].maximum_uplift == 0.004
    assert found.cycles[0].surfaces[0].maximum_uplift == 0.0


def test_a_slider_that_is_loose_has_no_slip_velocity() -> None:
    run = bilinear()
    speed, lift = np.zeros_like(run.history.slip_velocity), np.zeros_like(run.history.lift)
    speed[:, 0, 0], speed[7, 0, 0], lift[7, 0] = 0.01, 12.0, 1e-3  # it tumbles while it flies
    effects = dataclasses.replace(run.scene.effects, uplift=True)
    flying = dataclasses.replace(
        run,
        scene=dataclasses.replace(run.scene, effects=effects),
        history=dataclasses.replace(run.history, slip_velocity=speed, lift=lift),
    )
    assert characterise(flying).surfaces[0].peak_velocity == 0.01


def test_without_a_radius_there_is_no_heat_flux() -> None:
    found = characterise(bilinear(rim_radius=0.0))
    assert (found.surfaces[0].peak_heat_flux, found.surfaces[0].heat, found.surfaces[0].contact_area) == (None,) * 3
    assert any("heat flux" in note and note.endswith("surface 1") for note in found.notes)


def test_ways_that_do_not_close_are_no_cycles() -> None:
    found = characterise(bilinear((0, D, -0.6 * D, 0.5 * D)))
    assert found.kind == "one direction" and not found.cycles and not found.envelope
    assert found.first_loading is not None and any("no cycle closes" in note for note in found.notes)


def test_a_loop_away_from_zero_is_no_cycle() -> None:
    """(|F+| + |F-|)/(|Delta+| + |Delta-|) means nothing where both ends lie on one side."""
    assert not characterise(bilinear((0, D, D / 2, D, D / 2, D))).cycles


def test_residual_displacement_needs_rest() -> None:
    moving, resting = characterise(bilinear((0, D, 0.2 * D))), characterise(_held(bilinear((0, D, 0.2 * D))))
    assert not moving.at_rest and any("still moves" in note and "motion.hold" in note for note in moving.notes)
    assert resting.at_rest and resting.residual_displacement == pytest.approx(0.2 * D)
    assert not any("still moves" in note for note in resting.notes)


def _held(run: Result) -> Result:
    """The same run with its last row held for as long again."""
    rows = run.history
    columns: dict[str, Any] = {
        name: np.concatenate([values, np.repeat(values[-1:], 300, axis=0)]) for name, values in rows.arrays().items()
    }
    columns["time"] = np.append(rows.time, rows.time[-1] + np.linspace(0.01, 2, 300))
    columns["energy"] = {name: np.append(e, np.repeat(e[-1], 300)) for name, e in rows.energy.items()}
    return dataclasses.replace(run, history=dataclasses.replace(rows, **columns))


def test_two_directions_have_an_envelope_and_no_loop() -> None:
    found = characterise(loops(both=True))
    assert found.kind == "two directions" and found.cycles == () and found.first_loading is None
    assert found.peak_displacement == pytest.approx(np.hypot(*loops(both=True).history.displacement[:, :2].T).max())
    assert found.envelope == {} and any("two directions" in note for note in found.notes)


def test_a_bearing_that_did_not_move_is_bad_input() -> None:
    still = Result(scene(capacities=(1.0,)), history(np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((5, 1)), (1.0,)))
    with pytest.raises(InputError, match="did not move"):
        characterise(still)


def test_turning_points_forget_a_quiver() -> None:
    u = np.array([0, 0.4, 1.0, 0.99, 1.02, 0.2, -0.9, -0.89, -1.0, 0.3, 1.0])
    assert turning_points(u, 0.05) == [0, 4, 8, 10]
    assert turning_points(u, 0.005) == [0, 2, 3, 4, 6, 7, 8, 10]
    assert turning_points(np.zeros(4), 0.1) == [0]
    assert list(closed_cycles(u, [0, 4, 8, 10])) == [(4, 8, 10)]


def test_area_of_an_ellipse() -> None:
    t = np.linspace(0, 2 * pi, 4001)
    assert loop_area(2 * np.sin(t), 3 * np.cos(t)) == pytest.approx(6 * pi, rel=1e-6)
    assert loop_area(2 * np.sin(t), -3 * np.cos(t)) == pytest.approx(-6 * pi, rel=1e-6)


@cache
def single_pendulum() -> tuple[Scene, Characterisation]:
    """One slider in a bowl under a free plate, hardly any elastic slip, pushed slowly."""
    top = Body(height=0.02, centroid=0.01, mass=0.1, inertia=(1e-4, 1e-4), rim_radius=0.05)
    surface = Surface(radius=0.5, capacity=0.3, friction=0.05, yield_displacement=1e-5, rim_stiffness=1e7)
    bearing = Bearing(layout=Layout(2, 1, 0), base_height=0.01, surfaces=[surface], bodies=[top])
    made = Scene(
        bearing,
        Motion.harmonic(0.1, 0.01, cycles=1.0),
        Top.rig(axial_load=1e5, stiffness=1e10),
        Effects(dimension="planar", sliders="massless"),
        Solver(rtol=1e-6),
        output_step=0.05,
    )
    return made, simulate(made).characterise()


def test_single_pendulum_against_the_friction_circle() -> None:
    """F = N tan(a + b) out and N tan(a - b) back, sin a = d/L, sin b = rho/L with L = R - h and rho the circle."""
    _, found = single_pendulum()
    (cycle,) = found.cycles
    A, arm = cycle.loop.displacement_most, 0.48
    b = np.arcsin(0.05 * 0.5 / np.hypot(1, 0.05) / arm)
    d = np.linspace(-A, A, 20001)
    out, back = (1e5 * np.tan(np.arcsin(d / arm) + sign * b) for sign in (1, -1))
    energy, stiffness = np.trapezoid(out - back, d), out[-1] / A
    loop = cycle.loop
    assert abs(A - 0.1) < 1e-5
    assert loop.effective_stiffness == pytest.approx(stiffness, rel=2e-3)
    assert loop.energy_dissipated == pytest.approx(energy, rel=2e-3)
    assert loop.effective_damping == pytest.approx(energy / (2 * pi * stiffness * A**2), rel=3e-3)
    assert loop.zero_displacement_force == pytest.approx(1e5 * np.tan(b), rel=2e-3)
    middle = np.abs(d) < 0.7 * A
    assert cycle.stage_stiffness()[1,] == pytest.approx(np.polyfit(d[middle], out[middle], 1)[0], rel=1e-2)
    assert cycle.balance_energy == pytest.approx(loop.energy_dissipated, rel=2e-3)


@cache
def story() -> tuple[Push, dict[tuple[str, int], Any]]:
    push = Push(fenz(), 112e3, 1e6)
    return push, {(t.what, t.surface): t.at for t in closed_transitions(push, 0.14)}


@pytest.mark.slow
def test_stages_of_the_triple_pendulum_against_the_friction_circles() -> None:
    """Slopes of II, III and IV, and where they change: the closed form has no rounding and no weights."""
    first = preset_run("fenz-monotonic").characterise().first_loading
    assert first is not None
    assert [stage.surfaces for stage in first.stages] == [(1, 3), (1, 4), (2, 4), (2, 3)]
    push, told = story()
    for stage, (low, high) in zip(first.stages, ((0.01, 0.04), (0.055, 0.08), (0.095, 0.125)), strict=False):
        force = force_at(push, [low, high])
        assert stage.stiffness == pytest.approx((force[1] - force[0]) / (high - low), rel=0.02), stage
    for change, key in zip(first.transitions, (("slides", 4), ("rim", 1), ("rim", 4)), strict=True):
        assert change.displacement == pytest.approx(told[key].displacement, rel=0.02)
        assert change.force == pytest.approx(told[key].force, rel=0.02)


def test_table_4_2_comes_along_with_a_monotonic_run() -> None:
    found = preset_run("fenz-monotonic").characterise()
    assert found.kind == "monotonic" and found.cycles == ()
    assert found.transitions == preset_run("fenz-monotonic").summary["transitions"]
    assert found.transitions is not None and found.transitions["u_star_star"] == pytest.approx(49e-3, abs=2e-3)
    assert [use.capacity_left < 0 for use in found.surfaces] == [True, False, False, True]


@pytest.mark.parametrize("name", ["fenz-test2", "fenz-test4", "fenz-test5", "unusual-tfp"])
def test_loops_of_the_report_dissipate_what_the_energy_balance_says(name: str) -> None:
    found = preset_run(name).characterise()
    assert len(found.cycles) == 2
    for cycle in found.cycles:
        assert cycle.loop.energy_dissipated == pytest.approx(cycle.balance_energy, rel=2e-3)
        assert [b.start * b.end < 0 for b in cycle.branches] == [True, True]
    stiffness = found.envelope["effective_stiffness"]
    assert stiffness.most == pytest.approx(stiffness.least, rel=2e-3)  # the second cycle repeats the first


def test_stages_of_test_5_are_those_of_section_4_1() -> None:
    """On the way back: V unloads on 2 and 3, then II, III, IV, V again."""
    back, out = preset_run("fenz-test5").characterise().cycles[0].branches
    for branch in (back, out):
        assert [stage.surfaces for stage in branch.stages] == [(2, 3), (1, 3), (1, 4), (2, 4), (2, 3)]
    mirrored = [(-s.start, -s.end) for s in out.stages]
    assert np.array(mirrored) == pytest.approx(np.array([(s.start, s.end) for s in back.stages]), abs=1.5e-3)


def test_the_direction_of_the_motion_does_not_matter() -> None:
    along = scene_of("fenz-test2", {"dimension": "planar"})
    turned = dataclasses.replace(along, motion=along.motion.rotated(0.5))
    one, other = (simulate(made).characterise() for made in (along, turned))
    assert other.direction == pytest.approx((np.cos(0.5), np.sin(0.5)), abs=1e-6)
    for name, value in one.envelope.items():
        assert dataclasses.astuple(other.envelope[name]) == pytest.approx(dataclasses.astuple(value), rel=2e-3), name
    assert other.cycles[0].stage_stiffness() == pytest.approx(one.cycles[0].stage_stiffness(), rel=2e-3)


def test_an_orbit_is_characterised_by_its_envelope() -> None:
    found = preset_run("becker-circle-50").characterise()
    assert found.kind == "two directions" and not found.cycles
    assert found.peak_displacement == pytest.approx(0.05, rel=1e-2)
    peak = preset_run("becker-circle-50").summary["peak_force"]["radial"]
    assert found.peak_force == peak and 0 < found.secant_stiffness * found.peak_displacement < peak  # type: ignore


def rows_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


UNITS = {"mm": 1e-3, "kN": 1e3, "kN/m": 1e3, "s": 1.0, "J": 1.0, "%": 1e-2, "mm/s": 1e-3, "kW/m2": 1e3, "kJ/m2": 1e3}
"""Unit in the heading of a column -> its size in SI."""


def printed(table: Table) -> Array:
    """The numbers below headings with a unit, in SI; nan where there is none."""
    units = {place: UNITS[name[name.index("[") + 1 : -1]] for place, name in enumerate(table.columns) if "[" in name}
    cells = [["nan" if row[place] == "-" else row[place] for place in units] for row in table.rows]
    return np.array(cells, dtype=float) * [*units.values()]


def test_printed_numbers_are_in_the_unit_of_their_heading() -> None:
    found = characterise(preset_run("fenz-test2"))
    cycles, stages = found.tables()[1:3]
    assert found.first_loading is not None
    branches = (found.first_loading, *found.cycles[-1].branches)
    lines = [dataclasses.astuple(stage)[1:] for branch in branches for stage in branch.stages]
    assert printed(stages) == pytest.approx(np.array(lines), rel=3e-2, abs=6e-6)
    loops = [cycle.loop for cycle in found.cycles]
    names = ("displacement_least", "displacement_most", "effective_stiffness", "energy_dissipated", "effective_damping",
             "zero_displacement_force")  # fmt: skip
    values = [[getattr(loop, name) for name in names] for loop in loops]
    shown = printed(Table("", cycles.columns, cycles.rows[: len(loops)]))
    periods = [cycle.effective_period for cycle in found.cycles]
    assert shown == pytest.approx(np.insert(np.array(values), 3, periods, axis=1), rel=6e-3, abs=6e-6)
    demand = ("capacity_left", "capacity_left_share", "peak_velocity", "peak_heat_flux", "heat", "maximum_uplift")
    values = [[getattr(surface, name) for name in demand] for surface in found.surfaces]
    assert printed(found.demand_table()) == pytest.approx(np.array(values, float), rel=6e-3, abs=6e-6, nan_ok=True)


def test_command_prints_tables_and_writes_csv(tmp_path: Any, capsys: Any) -> None:
    saved, table = tmp_path / "run.nc", tmp_path / "cycles.csv"
    run: Array | Result = preset_run("fenz-test2")
    assert isinstance(run, Result)
    run.to_netcdf(saved)
    assert main(["characterise", str(saved), "-o", str(table)]) == 0
    out, err = capsys.readouterr()
    assert err == f"wrote {table}\n"
    for words in ("k_eff [kN/m]", "first loading", "1+3", "capacity left [mm]", "still moves when the run ends"):
        assert words in out
    found, rows = run.characterise(), rows_of(table.read_text(encoding="utf-8"))
    assert [row["scope"] for row in rows] == ["cycle 1", "cycle 2", "least", "mean", "most", "run"]
    assert float(rows[1]["effective_stiffness [N/m]"]) == found.cycles[1].loop.effective_stiffness
    assert float(rows[3]["energy_dissipated [J]"]) == pytest.approx(found.envelope["energy_dissipated"].mean)
    assert float(rows[0]["stiffness sliding on 1+3 [N/m]"]) == pytest.approx(found.cycles[0].stage_stiffness()[1, 3])
    assert rows[2]["start [s]"] == "" and rows[5]["residual_displacement [m]"] == ""
    assert float(rows[5]["capacity_left_1 [m]"]) == run.summary["minimum_gap"][0]


def test_command_prints_json_of_a_preset(capsys: Any) -> None:
    assert main(["characterise", "fenz-test2", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == json.loads(json.dumps(preset_run("fenz-test2").characterise().as_dict())) and not err


def test_json_of_every_kind_holds_no_nan() -> None:
    for run in (bilinear(), loops(both=True), ramp(), bilinear(rim_radius=0.0)):
        found = characterise(run).as_dict()
        assert found and json.loads(json.dumps(found, allow_nan=False)).keys() == found.keys()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.nc"], "nowhere.nc"),
        (["nowhere.toml"], "nowhere.toml"),
        (["fenz-test2", "-o", "cycles.txt"], "--output"),
        (["fenz-test2", "-o", "nowhere/cycles.csv"], "does not exist"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], words: str, capsys: Any) -> None:
    assert main(["characterise", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and words in err


@pytest.mark.parametrize("later", [-1e-9, 0.0, 1e-9])
def test_of_peaks_that_rounding_tells_apart_the_first_is_named(later: float) -> None:
    from msfp_gen.results.history import first_peak

    radial = np.abs(np.sin(np.linspace(0.0, 4 * np.pi, 401)))
    radial[150:] *= 1.0 + later
    assert first_peak(radial) == 50
    radial[250] = 1.01
    assert first_peak(radial) == 250
    assert first_peak(np.linspace(0.0, 1.0, 11)) == 10
