"""What the result of a building offers: few lines, summary, bearings, dataset, files, notes, characterisation."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from support import ROOT
from support.buildings import MOTION, PLACES, pushed, pushed_scene
from support.synthetic import loops as loops_of_one
from support.synthetic import opened

from msfp_gen import Effects, InputError, Result, changed_scene, characterise, simulate
from msfp_gen.buildings.explain import explain
from msfp_gen.buildings.notes import shared
from msfp_gen.figures import FIGURES, animate, figures_of
from msfp_gen.report import write_report
from msfp_gen.results.characterise import characterised, csv_rows
from msfp_gen.results.history import ENERGY_BELOW
from msfp_gen.results.loops import ForcePath as Motions
from msfp_gen.results.note import Note
from msfp_gen.results.result import load_result
from msfp_gen.results.summary import summary_of_bearing
from msfp_gen.scene.fidelity import Backbone, at_fidelity
from msfp_gen.studies.bounding import CASES, Bounds, load_factors
from msfp_gen.studies.bounding.runs import Case, _quantity_table


@pytest.mark.slow
def test_the_note_of_a_cheaper_model_is_read_from_the_file(tmp_path: Path):
    run = simulate(at_fidelity(replace(pushed_scene(), duration=0.05), "rigid"))
    read = load_result(run.to_netcdf(tmp_path / "run.nc"))
    assert "fidelity" in {note.kind for note in run.notes}
    assert read.notes == run.notes and read.scene.fidelity == "rigid"


def test_a_result_prints_its_main_values():
    lines = repr(pushed()).splitlines()
    assert lines[0] == "Result of frame" and "status" in lines[1]
    assert any("at centres of mass" in line and "at corners" in line for line in lines)
    assert lines[2].split(maxsplit=1) == ["verdict", "within the limits of the device"]
    steps = pushed().counters["steps"]
    assert steps != len(pushed().time) - 1 and f"s in {steps} steps" in lines[3]
    html = pushed()._repr_html_()
    assert "<polyline" in html and "orbit of bearing" in html and "base shear" in html
    lines = repr(pushed().bearings[1]).splitlines()
    assert lines[0] == "Result of bearing 2 (B) of frame" and "5_2_2 at (-3, 2) m" in lines[3]
    assert "<polyline" in pushed().bearings[1]._repr_html_()
    assert all(table.text for run in (pushed(), pushed().bearings[1]) for table in run.tables())


def test_summary_is_that_of_the_rows():
    found, s = pushed(), pushed().summary
    assert json.loads(json.dumps(s)) == s
    weight = pushed_scene().axial_loads.sum()
    assert s["weight"] == pytest.approx(weight, rel=1e-9)
    shear = np.hypot(*found.base_reaction[:, :2].T).max()
    assert 1.05 * shear > s["peak_force"]["radial"] > (1 - 1e-12) * shear  # sums in another order
    assert s["peak_force_ratio"] == s["peak_force"]["radial"] / s["weight"]
    roof = found.node("floor 3")[:, 2, :2]
    acceleration = np.hypot(*roof.T).max()
    assert s["floors"][3]["peak_acceleration"]["radial"] > (1 - 1e-12) * acceleration  # C rounds the root otherwise
    assert s["storeys"][0]["peak_drift_ratio"] == s["storeys"][0]["peak_drift"]["radial"] / 3.0
    assert (
        s["minimum_load_ratio"] <= (found.axial_force / pushed_scene().axial_loads).min() < 1 < s["maximum_load_ratio"]
    )
    moved = np.abs(found.bearing_displacement[:, :, 0]).max()
    assert moved > 0 and s["peak_displacement"]["E1"] == pytest.approx(moved)
    assert [each["position"] for each in s["bearings"]] == [list(place) for place in PLACES]
    assert s["wall_time"] > 0 and s["counters"]["steps"] > 0 and s["notes"] == [] and s["rims_met"] == []


def test_bearings_have_the_signs_of_a_run_of_one_bearing():
    """u is base less top, and F, the force of the bearing on what stands on it, has the sign of u while sliding on."""
    for index, one in enumerate(pushed().bearings):
        assert one.history.displacement == pytest.approx(-pushed().bearing_displacement[:, index], abs=1e-15)
        row = int(np.hypot(*one.history.displacement[:, :2].T).argmax())
        assert one.history.top_force[row, :2] @ one.history.displacement[row, :2] > 0
        assert pushed().axial_force[:, index] == pytest.approx(one.history.top_force[:, 2])
    total = sum(one.history.top_force for one in pushed().bearings)
    inertia = pushed().base_reaction
    assert np.abs(total - inertia)[:, :2].max() < 0.02 * np.abs(inertia).max()  # inertia of the bearings themselves


def test_a_bearing_has_what_a_run_of_one_bearing_has(tmp_path: Path):
    """Variables, units and meanings of its dataset, keys of its summary, quantities of its characterisation, files."""
    one, alone = pushed().bearings[1], loops_of_one()
    for name, variable in one.dataset.data_vars.items():
        assert name in alone.dataset or name in {f"energy_{word}" for word in ENERGY_BELOW}
        if name in alone.dataset:
            assert variable.dims == alone.dataset[name].dims and variable.attrs == alone.dataset[name].attrs
    assert np.array_equal(one.dataset["top_force"], one.history.top_force) and one.dataset.sizes["surface"] == 4
    assert summary_of_bearing(alone).keys() <= one.summary.keys() & alone.summary.keys()
    found = characterise(one)
    assert found.as_dict().keys() == alone.characterise().as_dict().keys()
    assert found.peak_force == one.summary["peak_force"]["radial"] and found.secant_stiffness > 0
    assert found.surfaces[0].capacity_left == one.summary["minimum_gap"][0] and "slip velocities" in found.notes[-1]
    assert all(table.text for table in found.tables()) and csv_rows(found)
    path = one.save(tmp_path / "one.csv")
    assert path.read_text().startswith("# bearing 2 (B) of frame, status ok; u = base - top")
    assert isinstance(one, Result) and figures_of(one).keys() < figures_of(alone).keys()
    for result in (one, alone):
        assert all(plot(result) for plot in figures_of(one).values())
        assert result.verdict.ok and result.summary["verdict"]["word"] == "within"
        assert result.bearings == (result,) and result.bearing.layout.surfaces == result.history.surfaces == 4
    file = one.save(tmp_path / "one.nc")
    assert opened(file).identical(one.dataset)
    with pytest.raises(InputError, match="one bearing of a building; give the file of the building"):
        load_result(file)


def test_a_file_without_extremes_is_refused(tmp_path: Path):
    path = pushed().to_netcdf(tmp_path / "frame.nc")
    with h5py.File(path, "r+") as file:
        del file["extremes"]
    with pytest.raises(InputError, match=r"frame\.nc.*the group extremes is missing"):
        load_result(path)


def test_torsion_of_the_base_is_that_of_the_masses():
    """Its moment about the centre of mass is what turns the building."""
    building, found = pushed_scene().building, pushed()
    motions = building.rigid_motions
    moments = found.acceleration @ (building.mass @ motions)
    x, y = pushed_scene().mass_centre
    about = moments[:, 5] - x * moments[:, 1] + y * moments[:, 0]
    assert np.abs(found.base_torsion - about).max() < 0.05 * np.abs(about).max()
    assert np.abs(about).max() > 0


def test_the_bearings_provide_the_overturning_moment():
    """Axial forces beyond those at rest at their arms, and the moments of the upper ends: statics, all digits."""
    found, arms = pushed(), pushed_scene().places - pushed_scene().mass_centre
    force, moment = -found.wrench[:, :, 1, :3], -found.wrench[:, :, 1, 3:]
    axial = force[..., 2] - pushed_scene().axial_loads
    about = np.stack([axial @ arms[:, 1] + moment[..., 0].sum(1), moment[..., 1].sum(1) - axial @ arms[:, 0]], axis=1)
    assert np.abs(found.overturning_moment - about).max() < 1e-8 * np.abs(about).max()
    peaks, rows = found.summary["peak_overturning_moment"], np.abs(about).max(axis=0)
    for row, peak in zip(rows, (peaks["E1"], peaks["E2"]), strict=True):
        assert (1.0 - 1e-9) * row <= peak < 1.02 * row
    assert set(peaks) == {"E1", "E2", "radial"} and peaks["radial"] >= max(peaks["E1"], peaks["E2"])


def test_drift_at_a_corner_is_that_of_both_floors_there():
    """A floor that twists drifts more at a corner than at its stiffness centre."""
    found = pushed()
    below, above = (found.node(name)[:, 0] for name in ("floor 1", "floor 2"))
    (x, y), height = (
        pushed_scene().places.max(axis=0),
        np.diff([node.position[2] for node in pushed_scene().building.nodes])[1],
    )
    centre = found.scene.building.node("floor 1").position
    turned = [node[:, :2] + node[:, 5:] * [centre[1] - y, x - centre[0]] for node in (below, above)]
    tilt = 0.5 * height * np.stack([above[:, 4] + below[:, 4], -above[:, 3] - below[:, 3]], axis=1)
    assert found.corner_drift[:, 1, 2, :2] == pytest.approx(turned[1] - turned[0] - tilt, abs=1e-9)
    for storey, most in zip(found.summary["storeys"], found.corner_drift, strict=False):
        assert storey["peak_corner_drift_ratio"] >= storey["peak_drift_ratio"] > 0 and most.size
    ratios = [storey["peak_corner_drift_ratio"] for storey in found.summary["storeys"]]
    assert found.summary["peak_corner_drift_ratio"] == max(ratios)


def test_dataset_states_signs_and_is_addressed_by_names():
    dataset = pushed().dataset
    assert dataset["bearing_displacement"].attrs["sign"] == "base less top"
    assert dataset["axial_force"].attrs["sign"] == "compression" and dataset["drift"].sizes["storey"] == 3
    top = dataset["node_acceleration"].sel(node="floor 3", freedom="u1").to_numpy()
    assert np.array_equal(top, pushed().node("floor 3")[:, 2, 0])


@pytest.mark.slow  # a layout of its own with plates that turn
def test_bearings_of_other_layouts_have_no_values_where_they_have_no_surface():
    from msfp_gen import presets

    given = pushed_scene()
    double = replace(given.bearings[0], bearing=presets.bearing("double-fp").replace(gravity=given.gravity))
    found = simulate(replace(given, bearings=[double, *given.bearings[1:]], duration=0.1))
    values = found.dataset["sliding"].to_numpy()
    assert np.isfinite(values[:, 0, :2]).all() and np.isnan(values[:, 0, 2:]).all() and np.isfinite(values[:, 1:]).all()
    assert len(found.bearings[0].summary["peak_sliding"]) == 2


@pytest.mark.parametrize("kind", ["heat", "inertia"])
def test_notes_of_monitors_name_the_bearing(kind):
    uplift = Note(0.14, "uplift", 3, 5.0, "it is unloaded", "uplift = True")
    alike = [Note(0.2 + index, kind, 1, 10.0 + index, "it is much", bearing=index + 1) for index in range(3)]
    lifted = replace(uplift, bearing=1)
    found = replace(pushed(), monitored=(*alike[::-1], lifted, replace(uplift, time=0.3, action="", bearing=3)))
    assert [note.line for note in found.notes] == [
        "t = 0.14 s: bearing 1 (A): it is unloaded; continued with uplift = True",
        "t = 0.3 s: bearing 3: it is unloaded",
        "t = 2.2 s: bearing 3: it is much; the same holds for 2 other bearings, with less",
    ]
    assert found.bearings[0].model_changes == (lifted,) and found.bearings[2].model_changes == ()
    assert "notes" in repr(found)


def test_equal_notes_of_many_bearings_are_one_note() -> None:
    """Sliders of all four that would tip are one note, with the one that would tip furthest."""
    alike = [Note(0.1 * k, "footprint", 1, 0.01 * k, f"{k} cm", bearing=k) for k in range(1, 5)]
    opened = [Note(0.1, "uplift", 1, -k, "it pulls", "uplift = True", bearing=k) for k in (1, 2)]
    lines = [note.line for note in replace(pushed(), monitored=(*alike, *opened)).notes]
    assert [line for line in lines if "cm" in line] == [
        "t = 0.4 s: bearing 4: 4 cm; the same holds for 3 other bearings, with less"
    ]
    assert sum("it pulls" in line for line in lines) == 2  # their models changed: each stays


def test_explain_has_one_line_for_interfaces_of_one_kind() -> None:
    scene = changed_scene("hospital-clc", {"building.interface.rotational_stiffness": 3.5e6})
    lines = [
        line for table in scene.explain() for row in table.rows for line in row if "rotational_stiffness = " in line
    ]
    assert len(lines) == 1 and "the same holds for 11 other bearings" in lines[0], lines


def test_characterisation_of_the_isolation_system():
    found = characterise(pushed())
    assert found.cycles == () and "no cycle closes" in found.notes[0] and len(found.bearings) == 4
    assert len(repr(found).splitlines()) <= 10
    assert json.dumps(found.as_dict(), allow_nan=False)
    assert found.secant_stiffness > 0 and found.peak_force == pushed().summary["peak_force"]["radial"]
    with pytest.raises(InputError, match="did not move"):
        characterise(replace(pushed(), displacement=0 * pushed().displacement, support=0 * pushed().support))


def test_cycles_of_a_motion_along_one_axis():
    """Base shear k u + Q sign(v) over u = A sin: k_eff = k + Q/A, energy 4 Q A; as of one bearing under the weight."""
    time = np.linspace(0.25, 3.25, 3001)
    k, strength, amplitude, direction, weight = 2e6, 3e5, 0.1, np.array([0.6, 0.8]), 9.81e5
    u, rate = amplitude * np.sin(2 * np.pi * time), np.cos(2 * np.pi * time)
    force, lost = k * u + strength * np.sign(rate), 4 * strength * amplitude * (time - time[0])
    path = Motions.of(time, np.outer(u, direction), np.outer(force, direction))
    system = characterised("", "ok", path, (amplitude, 5e5), weight, 9.81, lost)
    assert len(system.cycles) == 3 and system.kind == "cycles"
    loop = system.cycles[0].loop
    assert loop.energy_dissipated == pytest.approx(4 * strength * amplitude, rel=1e-2)
    assert loop.energy_dissipated == pytest.approx(system.cycles[0].balance_energy, rel=1e-2)
    assert loop.zero_displacement_force == pytest.approx(strength, rel=1e-6)
    stiffness = system.envelope["effective_stiffness"].mean
    assert stiffness == pytest.approx(k + strength / amplitude, rel=1e-6)
    period = 2 * np.pi * np.sqrt(1e5 / stiffness)
    assert system.envelope["effective_period"].mean == pytest.approx(period, rel=1e-12)
    given = pushed().characterise()
    found = replace(given, **{name: getattr(system, name) for name in ("cycles", "envelope", "kind", "axial_load")})
    assert len(repr(found).splitlines()) <= 10 and "of the weight" in repr(found)
    titles = [table.title for table in found.tables()]
    assert titles[0].startswith("isolation system of frame") and "closed cycles" in titles
    assert [row["scope"] for row in csv_rows(found)] == [
        "cycle 1",
        "cycle 2",
        "cycle 3",
        "least",
        "mean",
        "most",
        "run",
    ]
    sideways = np.outer(u, direction) + np.outer(np.cos(time), [0.01, 0.0])
    assert list(Motions.of(time, sideways, np.outer(force, direction)).cycles()) == []


def test_effects_of_each_bearing_are_selected_and_explained():
    from msfp_gen.scene.explain import explain

    given = pushed_scene()
    assert given.modelled == 4 * (Effects(),)
    lifted = replace(given, motion=replace(MOTION, coefficients=_vertical(MOTION.coefficients)))
    assert all(effects.uplift for effects in lifted.modelled)
    shaken = replace(given, bearings=[replace(given.bearings[0], motion=lifted.motion), *given.bearings[1:]])
    assert all(effects.uplift for effects in shaken.modelled)  # bearing 1 may take the load off the others
    assert "the ground moves differently" in "\n".join(table.text for table in explain(shaken))
    mixed = replace(given, bearings=[replace(given.bearings[0], effects=Effects(rims=False)), *given.bearings[1:]])
    text = "\n".join(table.text for table in explain(mixed))
    assert "bearing 1: effects as given" in text and "bearings 2-4: effects selected" in text
    assert "of the load at rest remains" in text and "4 bearings" in text


def _vertical(coefficients: np.ndarray) -> np.ndarray:
    """A motion along E1 as one along E3, ten times as large."""
    changed = np.zeros_like(coefficients)
    changed[:, 2] = 10 * coefficients[:, 0]
    return changed


def test_motions_of_supports_come_back_from_a_file(tmp_path: Path):
    given = pushed_scene()
    own = [replace(each, motion=MOTION) if each.name else each for each in given.bearings]
    found = simulate(replace(given, bearings=own, duration=0.2))
    read = load_result(found.save(tmp_path / "frame.nc"))
    assert [each.motion == MOTION for each in read.scene.bearings] == [True, True, False, False]
    assert read.scene.bearings[2].motion is None and np.array_equal(read.support, found.support)
    assert read.summary == found.summary


def test_a_bearing_at_other_times():
    one = pushed().bearings[1]
    between = one.at_times(0.5 * (one.history.time[3] + one.history.time[4]))
    assert between.label == one.label and between.history.displacement.shape == (1, 3)
    np.testing.assert_allclose(between.history.displacement[0], one.history.displacement[3:5].mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(between.history.sliding[0], one.history.sliding[3:5].mean(axis=0), rtol=1e-12)


def test_bearings_of_a_building_at_other_times_keep_their_displacement():
    """It is that since the start of the run, not since the first of the times."""
    building = pushed()
    rows = [5, 9]
    shown = building.at_times(building.time[rows])
    for one, then in zip(building.bearings, shown.bearings, strict=True):
        assert then.history.displacement == pytest.approx(one.history.displacement[rows], abs=1e-15)
        assert np.abs(then.history.displacement[0]).max() > 1e-4


def test_a_doubt_about_a_shared_bearing_is_one_note() -> None:
    """Seventy bearings of one kind under different loads: one note, as one of each other value."""
    doubt = "bearing.surfaces[0].rim_stiffness = 300 N/m stops no slider: the load at rest is {} N"
    values = [Note(0.0, "value", 1, 300.0, doubt.format(1e6 + k), bearing=k) for k in range(1, 71)]
    other = Note(0.0, "value", 2, 0.5, "bearing.surfaces[1].friction = 0.5 is unusually high", bearing=3)
    first, second = shared([*values, other])
    assert first.text == doubt.format(1e6 + 1) + "; the same holds for 69 other bearings" and first.bearing == 1
    assert second == other


def test_what_is_left_names_its_surface_and_what_is_used_is_of_the_bearing():
    """The least gap may be of an inner surface while the dishes have more left."""
    run = pushed()
    for index, (one, demand) in enumerate(zip(run.bearings, run.characterise().bearings, strict=True)):
        gaps = one.extremes.gap
        surface, capacity = int(gaps.argmin()), Backbone.of(one.bearing).capacity
        used = float(one.extremes.displacement[3]) / capacity
        for table, column in (
            (run.part_tables()[-1], "least left [mm]"),
            (run.characterise().demand_table(), "left [mm]"),
        ):
            row = table.rows[index]
            assert row[table.columns.index(column)] == f"{1e3 * gaps[surface]:.1f} of {surface + 1}"
            assert row[table.columns.index("used [%]")] == f"{100 * used:.0f}"
        assert demand.capacity_left == gaps.min() and demand.displacement_used == used


def test_a_bearing_that_lifts_has_no_tension():
    """Below a bearing that is open hangs its top plate; that is no pull of the bearing."""
    run = pushed()
    least = run.extremes.axial_force.copy()
    least[1, 0] = -500.0
    lifted = replace(run, extremes=replace(run.extremes, axial_force=least))
    assert lifted.summary["minimum_load_ratio"] == lifted.bearings[1].summary["minimum_load_ratio"] == 0.0
    assert dict(lifted.main_results())["N over N at rest"].startswith("0.00 (lifts) to ")
    texts = [row[lifted.part_tables()[-1].columns.index("N / N at rest")] for row in lifted.part_tables()[-1].rows]
    assert texts[1].startswith("0.00 (lifts) ... ") and "lifts" not in texts[0]


def test_bounds_name_the_bearing_and_surface_with_the_least_capacity_left():
    """And the share of its capacity, by the rows of every bearing and surface."""
    result = pushed()
    cases = tuple(Case(name, result.scene, result, result.characterise()) for name in CASES)
    bounds = Bounds(load_factors("asce7"), {}, cases)
    left = np.array([one.extremes.gap for one in result.bearings])
    bearing, surface = np.unravel_index(left.argmin(), left.shape)
    share = left[bearing, surface] / result.bearings[bearing].bearing.surfaces[surface].capacity
    place = bounds.places()["capacity_left"]["lower"]
    name = result.scene.bearings[bearing].name
    assert place == f"bearing {bearing + 1}{f' {name}' if name else ''}, surface {surface + 1}: {100 * share:.3g} %"
    assert bounds.quantities()["capacity_left"]["lower"] == left.min()
    rows = {row[0]: row[1:] for row in _quantity_table(bounds).rows}
    assert rows["least capacity left of a surface is of"] == (place, place, place, "")
    assert bounds.as_dict()["places"] == {"capacity_left": dict.fromkeys(CASES, place)}


def test_words_of_the_field_come_first():
    """In what is printed of a building; the words of its matrices are in the glossary, each beside its own."""
    scene, result = pushed_scene(), pushed()
    text = "\n".join(table.text for table in [*explain(scene), *result.tables()])
    words = {
        "diaphragm": "node", "joint to the building": "interface", "degrees of freedom": "coordinates",
        "on a fixed base": "attachments", "isolator type 1": "kind", "base shear": "base_reaction",
    }  # fmt: skip
    for first, other in words.items():
        assert first in text and not re.search(rf"\b{other}s?\b", text), (first, other)
    glossary = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    for word in ("isolator", "joint", "diaphragm", "degree of freedom", "base shear"):
        assert f"| {word} | `" in glossary


DRAWN = {name: (draw, ".png") for name, draw in FIGURES.items()}
DRAWN |= {"movie": (partial(animate, seconds=0.2), ".gif"), "report": (write_report, ".html")}


@pytest.mark.parametrize("name", DRAWN)
def test_a_bearing_of_a_building_is_drawn_or_refused_in_one_line(name: str, tmp_path: Path):
    one, (draw, suffix) = pushed().bearings[1], DRAWN[name]
    file = tmp_path / f"one{suffix}"
    if name in figures_of(one):
        draw(one, file)
        assert file.stat().st_size > 1000
        return
    with pytest.raises(InputError, match=r"^bearing 2 \(B\): the rows of a building have no .*; run the bearing.*$"):
        draw(one, file)
    assert not list(tmp_path.iterdir())


def test_a_bearing_of_a_building_has_no_counters_and_no_scene_of_its_own():
    one = pushed().bearings[1]
    assert set(figures_of(one)) == {"overview", "loops", "orbit", "sliding"} and len(DRAWN) == 10
    assert one.counters is None and one.work == {} and pushed().work["steps"] > 0
    for read in (lambda: one.alone, lambda: one.friction_coefficient):
        with pytest.raises(InputError, match="rows of a building"):
            read()
    alone = loops_of_one()
    assert alone.alone == (alone.scene, alone.history, alone.counters)
