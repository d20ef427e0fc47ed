"""The verdict of a run: every limit exceeded and not, of a bearing and of a building; what it says, and where."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT, preset_run, thinned
from support.buildings import BEARING, frame, rocking, scene
from support.synthetic import LOAD, loops

from msfp_gen import (
    Auto,
    BuildingScene,
    Effects,
    InputError,
    Limits,
    Result,
    RunError,
    Scene,
    changed_scene,
    load_scene,
    presets,
    simulate,
)
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.cli import main
from msfp_gen.common.identity import fingerprint
from msfp_gen.report.page import outcome
from msfp_gen.results.history import Event
from msfp_gen.results.note import Note
from msfp_gen.results.result import load_result
from msfp_gen.results.sliding import intervals, merged, openings
from msfp_gen.results.verdict import LIMITS, RIM_SHARE, LimitReading, ReachedValue
from msfp_gen.scene.explain import explain
from msfp_gen.scene.plausibility import scene_doubts

OPENING = 3e-3  # [m]
GIVEN = [limit.key for limit in LIMITS if limit.key in {field.name for field in fields(Limits)}]


@cache
def opened() -> Result:
    """Two cycles, in which surface 2 opens twice by up to 3 mm: for 0.3 s from 4 s on, and for 0.1 s from 12 s on."""
    result = loops()
    lift, time = np.zeros_like(result.history.lift), result.history.time
    lift[(time > 4.0) & (time < 4.305), 1] = OPENING
    lift[(time > 12.0) & (time < 12.105), 1] = 0.5 * OPENING
    return replace_history(result, lift=lift)


def replace_history(result: Result, **rows: Any) -> Result:
    return Result(
        result.scene, replace(result.history, **rows), result.events, result.counters, provenance=result.provenance
    )


@cache
def at_the_rims() -> BuildingResult:
    """A frame whose lower dishes are met at every bearing."""
    return simulate(scene(frame(), bearing=BEARING.replace(capacity=[0.03, 0.0215, 0.0215, 0.03]), output_step=1e-3))


@cache
def lifted() -> BuildingResult:
    return simulate(replace(rocking(Effects(uplift=True)), output_step=1e-3))


@cache
def heated_building() -> BuildingResult:
    """The frame with friction that depends on temperature, after a second of its motion."""
    bearing = BEARING.replace(reference_pressure=1.37e7)
    made = scene(frame(), bearing=bearing, duration=1.0)
    hot = [replace(one, effects=Auto(friction="pvt", bouc_wen="plastic")) for one in made.bearings]
    return simulate(replace(made, bearings=hot))


@cache
def heated() -> Result:
    return simulate(load_scene(ROOT / "examples" / "heating.toml"))


def judged(result: Any, **limits: float) -> Any:
    """The verdict of a run under these limits."""
    return replace(result, scene=replace(result.scene, limits=Limits(**limits))).verdict


REACHED: list[tuple[str, Any, float, int, int]] = [  # limit, run, value, bearing, surface
    ("rim_force", lambda: preset_run("fenz-test5"), 15.12e3, 0, 1),
    ("rim_force", at_the_rims, 9211.1, 2, 1),
    ("rim_compression", lambda: preset_run("fenz-test5"), 1.512e-3, 0, 1),
    ("rim_compression", at_the_rims, 9.2111e-4, 2, 1),
    ("uplift_height", opened, OPENING, 0, 2),
    ("uplift_duration", opened, 0.3, 0, 2),
    ("temperature", heated, 239.07, 0, 1),
    ("temperature", heated_building, 27.66, 1, 1),
    ("axial_load", lambda: preset_run("fenz-test5"), LOAD, 0, 0),
    ("axial_load", at_the_rims, 151.84e3, 1, 0),
    ("displacement", lambda: preset_run("fenz-test5"), 0.13988, 0, 0),
    ("displacement", at_the_rims, 0.06905, 2, 0),
]


@pytest.mark.parametrize(
    ("key", "run", "value", "bearing", "surface"),
    thinned(REACHED, lambda key, run, *_: key not in ("rim_compression", "axial_load", "temperature")),
)
def test_a_limit_below_the_value_is_exceeded_and_one_above_is_not(
    key: str, run: Any, value: float, bearing: int, surface: int
) -> None:
    result = run()
    reading = judged(result, **{key: 1e-9 if key != "temperature" else 21.0}).worst[key]
    assert reading.value.reached == pytest.approx(value, rel=0.02) and reading.exceeded
    assert (reading.bearing, reading.value.surface) == (bearing, surface)
    just = reading.value.reached
    below, above = judged(result, **{key: just * (1 - 1e-9)}), judged(result, **{key: just * (1 + 1e-9)})
    assert key in {one.limit.key for one in below.exceeded} and below.word == "exceeded" and not below.ok
    assert key not in {one.limit.key for one in above.exceeded}
    assert f"limit {reading.limit.shown(just)}" in below.text
    if bearing:
        assert result.scene.label(bearing - 1) in below.text
    if surface:
        assert f"surface {surface}" in below.text


def test_openings_of_a_building_are_counted_in_its_rows() -> None:
    """Their heights are over all steps."""
    result = lifted()
    height = judged(result, uplift_height=1e-6).worst["uplift_height"]
    assert height.value.reached == result.extremes.lift.max() > 1e-5 and height.exceeded
    assert not judged(result, uplift_height=1e-3).worst["uplift_height"].exceeded
    longest = max(
        length
        for bearing in range(4)
        for surface in range(4)
        for _, length in intervals(result.time, result.lift[:, bearing, surface] > 0)
    )
    reading = judged(result, uplift_duration=0.99 * longest).worst["uplift_duration"]
    assert reading.value.reached == longest >= 0.01 and reading.exceeded and reading.bearing in (2, 3)
    assert not judged(result, uplift_duration=1.01 * longest).worst["uplift_duration"].exceeded


def test_every_limit_that_can_be_given_is_read() -> None:
    assert {key for key, *_ in REACHED} == set(GIVEN) == {field.name for field in fields(Limits)}


def test_the_defaults_are_those_of_the_page() -> None:
    result = preset_run("fenz-test5")
    worst = result.verdict.worst
    assert worst["rim_force"].value.allowed == RIM_SHARE * LOAD and result.verdict.ok
    assert worst["travel"].value[2:] == (2.0, 3.0)
    assert lifted().verdict.worst["uplift_height"].value.allowed == BEARING.arrays()["rim_offset"][3]
    assert worst["rim_compression"].value.allowed == pytest.approx(0.1 * 0.065)
    assert not {"axial_load", "displacement"} & worst.keys()
    assert Limits() == Limits(uplift_duration=0.1, temperature=250.0)


def test_times_are_those_of_the_values() -> None:
    spell = judged(opened(), uplift_duration=0.2).exceeded
    assert [round(one.value.time, 2) for one in spell] == [4.0] and spell[0].value.reached == pytest.approx(
        0.3, abs=0.01
    )
    reading = preset_run("fenz-test5").verdict.worst["rim_force"]
    history = preset_run("fenz-test5").history
    row = int(history.rim_force[:, 0].argmax())
    assert reading.value.time == pytest.approx(
        history.time[row], abs=2 * np.diff(history.time[row - 1 : row + 2]).max()
    )


@pytest.mark.parametrize(
    "run", [lambda: preset_run("fenz-test5"), pytest.param(heated, marks=pytest.mark.slow), at_the_rims, lifted]
)
def test_value_and_surface_are_those_of_the_rows_at_the_time(run: Any) -> None:
    """Of every reading with a time: an independent look at the dense rows."""
    result, seen = run(), set()
    for reading in judged(result, axial_load=1.0, displacement=1e-6).readings:
        value, one = reading.value, result.bearings[max(reading.bearing - 1, 0)]
        rows = {
            "rim_force": one.history.rim_force,
            "rim_compression": np.maximum(-one.history.gap, 0.0),
            "uplift_height": one.history.lift,
            "temperature": one.history.temperature,
            "axial_load": np.abs(one.history.top_force[:, 2:3]),
            "displacement": one.history.horizontal[:, None],
        }.get(reading.limit.key)
        if rows is not None and value.time is not None:
            row = int(np.abs(one.history.time - value.time).argmin())  # peaks are those of steps
            if reading.limit.key == "uplift_height" and abs(one.history.time[row] - value.time) > 1e-9:
                continue  # a contact opens and closes between two rows
            assert rows[row, max(value.surface - 1, 0)] == pytest.approx(value.reached, rel=0.02)
            seen.add(reading.limit.key)
    assert {"axial_load", "displacement"} < seen and ("uplift_height" in seen or run is not lifted)


def test_a_peak_that_no_row_has_keeps_its_time() -> None:
    """Such as the rim force of a building in the step in which its run fails: not that of the first row."""
    run = at_the_rims()
    known = judged(run, rim_force=1.0).worst["rim_force"].value
    quiet = replace(run, rim_force=np.zeros_like(run.rim_force), sliding=0.0 * run.sliding)
    reading = judged(quiet, rim_force=1.0).worst["rim_force"]
    assert reading.value == known and known.reached > 9e3 and known.time is not None
    assert f"{known.time:.4g} s" in judged(quiet, rim_force=1.0).text
    note = Note(0.28, "heat", 4, 240.0, "", value_time=1.5)
    hot = replace(preset_run("fenz-test2"), notes=(note,)).verdict.worst["temperature"]
    assert hot.value == ReachedValue(4, 1.5, 260.0, 250.0)
    beyond = Note(0.28, "rims", 1, 0.02, "", value_time=0.9)
    assert replace(preset_run("fenz-test5"), notes=(beyond,)).verdict.worst["beyond_rim"].value.time == 0.9


def test_rims_at_one_time_do_not_depend_on_the_rows() -> None:
    scene = changed_scene("fenz-test5", {"effects.dimension": "planar"})
    dense, sparse = simulate(scene), simulate(replace(scene, output_step=scene.end / 3))
    travels = [one.verdict.worst["travel"].value for one in (dense, sparse)]
    assert len(sparse.history.time) < 6 and travels[0].reached == travels[1].reached == 2
    assert travels[1].time == pytest.approx(travels[0].time, abs=2e-3)


def test_what_equals_its_limit_up_to_rounding_is_within() -> None:
    """Ten rows of 10 ms are 0.1 s."""
    reading = LimitReading(LIMITS[0], 0, "", ReachedValue(1, 0.0, 0.1 * (1 + 1e-12), 0.1))
    assert not reading.exceeded and replace(reading, value=reading.value._replace(reached=0.1 + 1e-9)).exceeded


def test_all_rims_at_one_time_leave_nothing_to_slide() -> None:
    result = loops()
    gap = result.history.gap.copy()
    gap[100:110] = -1e-5
    verdict = replace_history(result, gap=gap).verdict
    assert [one.limit.key for one in verdict.exceeded] == ["travel"]
    assert verdict.text == "exceeded: rims met at one time 4, limit 3 (1 s)"
    gap[100:110, 3] = 1e-3
    assert replace_history(result, gap=gap).verdict.ok


@pytest.mark.parametrize(
    ("note", "key", "text"),
    [
        (
            Note(2.0, "rims", 4, 0.02, ""),
            "beyond_rim",
            "sliding beyond a rim that the model leaves out 20 mm, limit 0 mm",
        ),
        (Note(3.0, "footprint", 1, 0.06, ""), "face", "contact off the axis of the slider 60 mm, limit 51 mm"),
        (Note(3.0, "heat", 1, 240.0, ""), "temperature", "temperature 260 degC, limit 250 degC (surface 1)"),
        (Note(3.0, "heat", 1, 200.0, ""), "", "within the limits"),
        (Note(3.0, "rims", 1, 0.02, "", "rims = True"), "", "within the limits"),
        (Note(3.0, "heat", 1, 300.0, "", "friction = pvt"), "", "within the limits"),
    ],
)
def test_monitors_of_what_the_model_leaves_out_count(note: Note, key: str, text: str) -> None:
    """Not where the run went on with a model that has the effect."""
    result = preset_run("fenz-test2")
    verdict = replace(result, notes=(note,)).verdict
    assert [one.limit.key for one in verdict.exceeded] == [key] * bool(key) and text in verdict.text


def test_a_contact_off_its_face_in_a_building() -> None:
    """With sliders of 10 mm below and above; with uplift they stand on their edges."""
    bearing = BEARING.replace(rim_radius=[0.01, 0.0255, 0.01, 0.0])
    given = scene(frame(), bearing=bearing, duration=0.8)
    closed = [replace(one, effects=Effects(uplift=False)) for one in given.bearings]
    verdict = simulate(replace(given, bearings=closed)).verdict
    beyond = [one for one in verdict.exceeded if one.limit.key == "face"]
    assert {one.value.surface for one in beyond} <= {1, 4} and all(one.value.allowed == 0.01 for one in beyond)
    assert "contact off the axis of the slider" in verdict.text and 0 < beyond[0].value.time <= 0.8
    standing = [replace(one, effects=Effects(uplift=True)) for one in given.bearings]
    lifting = simulate(replace(given, bearings=standing, duration=0.3)).verdict
    assert lifting.worst["face"].value.reached == 0
    assert simulate(scene(frame(), duration=0.8)).verdict.ok


def test_without_a_model_of_rims_no_force_is_made_up() -> None:
    """The sliding beyond the capacity is named in its place."""
    beyond = changed_scene("fenz-test5", {"effects.dimension": "planar", "effects.rims": False})
    verdict = simulate(beyond).verdict
    assert {one.limit.key for one in verdict.exceeded} == {"beyond_rim"}
    assert verdict.worst["rim_force"].value.reached == 0


def test_a_failed_run_is_not_within() -> None:
    failed = replace(preset_run("fenz-test5"), status="newton", message="stopped at t = 3 s")
    assert failed.verdict.word == "failed" and not failed.verdict.ok and failed.verdict.text == "the run failed"
    judgement = judged(failed, rim_force=1e3)
    assert judgement.text.startswith("the run failed; until then exceeded: rim force 15.12 kN, limit 1 kN (surface 1, ")
    pulled = changed_scene("fenz-test2", {"top": {"kind": "prescribed", "force": [0.0, 0.0, 1e4]}})
    with pytest.raises(RunError, match="the interface would have to pull") as caught:
        simulate(pulled)
    assert caught.value.result is None or caught.value.result.verdict.word == "failed"


def test_uplift_in_the_summary_and_in_tables() -> None:
    assert opened().summary["uplift"] == {"height": OPENING, "duration": pytest.approx(0.3, abs=0.011), "count": 2}
    assert loops().summary["uplift"] == {"height": 0.0, "duration": 0.0, "count": 0}
    summary = lifted().summary["bearings"]
    assert [bool(one["uplift"]["count"]) for one in summary] == [False, True, True, False]
    assert summary[2]["uplift"]["height"] == lifted().extremes.lift[2].max() > 0
    assert summary[2]["uplift"]["duration"] > 0.01
    titles = [table.title for table in lifted().tables()]
    assert "uplift of bearings" in titles and "uplift of bearings" not in [t.title for t in at_the_rims().tables()]
    text = "\n".join(table.text for table in lifted().tables())
    assert "height [mm]  longest [ms]  times" in text


@pytest.mark.slow
def test_temperatures_of_a_building_begin_at_the_start() -> None:
    hot, cold = heated_building(), at_the_rims()
    assert np.all(hot.temperature[0] == 20.0) and np.all(np.diff(hot.temperature, axis=0).max(axis=0) > 0)
    assert np.all(cold.temperature == 20.0) and np.all(cold.extremes.temperature == 20.0)
    assert hot.summary["bearings"][0]["peak_temperature"] == hot.extremes.temperature[0].tolist()
    assert hot.extremes.temperature == pytest.approx(hot.temperature.max(axis=0), rel=1e-2)
    assert "peak_temperature" not in cold.summary["bearings"][0]
    assert "peak T [degC]" in "\n".join(table.text for table in hot.bearings[0].tables())


@pytest.mark.parametrize(
    ("kinds", "first", "expected"),
    [
        ([(4.0, "lift_off"), (4.25, "landing"), (8.0, "lift_off"), (8.5, "landing")], 0.0, [(4.0, 0.25), (8.0, 0.5)]),
        ([(0.5, "landing"), (19.0, "lift_off")], 1e-3, [(0.0, 0.5), (19.0, 1.0)]),
        ([(4.0, "lift_off"), (4.1, "lift_off"), (4.25, "landing"), (4.3, "landing")], 0.0, [(4.0, 0.25)]),
        ([(4.0, "rim_contact")], 0.0, [(2.995, 0.11)]),
    ],
)
def test_events_say_how_long_a_surface_is_open(
    kinds: list[tuple[float, Any]], first: float, expected: list[tuple[float, float]]
) -> None:
    """Also from the start or until the end of the run; without such events the rows do."""
    time, lift = np.linspace(0.0, 20.0, 2001), np.zeros(2001)
    lift[0], lift[300:311] = first, OPENING
    events = [Event(when, 1, kind, np.zeros(3), np.zeros(3)) for when, kind in kinds]
    assert [pytest.approx(spell) for spell in openings(time, lift, events)] == expected


def test_openings_of_several_surfaces_are_one_of_the_bearing() -> None:
    assert merged([(4.0, 0.5), (1.0, 0.5), (4.25, 0.5), (4.75, 0.25), (6.0, 1.0)]) == [
        (1.0, 0.5),
        (4.0, 1.0),
        (6.0, 1.0),
    ]
    lifted = replace(
        opened(),
        events=tuple(
            Event(when, surface, kind, np.zeros(3), np.zeros(3))
            for when, surface, kind in [
                (4.0, 2, "lift_off"),
                (4.2, 3, "lift_off"),
                (4.3, 2, "landing"),
                (4.6, 3, "landing"),
            ]
        ),
    )
    assert lifted.summary["uplift"] == {"height": OPENING, "duration": pytest.approx(0.6), "count": 1}
    spell = lifted.verdict.worst["uplift_duration"].value
    assert (spell.surface, spell.time) == (3, 4.2) and spell.reached == pytest.approx(0.4)


def test_tables_of_rims_name_the_surface() -> None:
    summary, printed = at_the_rims().summary, repr(at_the_rims())
    assert [one["rims_met"] for one in summary["bearings"]] == [[1, 4], [1], [1], [1, 4]]
    assert summary["bearings"][1]["peak_rim_force"][0] == pytest.approx(9211.1, rel=1e-3)
    assert "rims met surfaces 1, 4 of 1, 4; 1 of 2, 3" in " ".join(printed.split())
    assert "rim [kN]" in "\n".join(table.text for table in at_the_rims().bearings[0].tables())


def test_a_bearing_of_a_building_has_its_own_verdict() -> None:
    limits = Limits(rim_force=8e3)
    result = replace(at_the_rims(), scene=replace(at_the_rims().scene, limits=limits))
    assert [one.verdict.word for one in result.bearings] == ["within", "exceeded", "exceeded", "within"]
    assert {reading.bearing for reading in result.verdict.exceeded} == {2, 3}
    assert "bearing 2, surface 1" in result.verdict.text and "and 1 other bearing)" in result.verdict.text
    assert result.summary["verdict"]["limits"] == "rim_force" and result.summary["verdict"]["word"] == "exceeded"
    printed = " ".join(repr(result).split())
    assert "verdict exceeded: rim force 9.208 kN, limit 8 kN (bearing 2, surface 1," in printed
    row = next(row for row in result.verdict.table.rows if row[0] == "rim force")
    assert row[1:4] == ("9.208 kN", "8 kN", "bearing 2, surface 1") and row[5] == "EXCEEDED"
    assert result.verdict.table.title.endswith("exceeded by 2 bearings")


@pytest.mark.parametrize("make", [lambda: preset_run("fenz-test5"), at_the_rims])
def test_plain_data_of_a_verdict(make: Any) -> None:
    verdict = judged(make(), rim_force=1.0).as_dict
    assert json.loads(json.dumps(verdict, allow_nan=False)) == verdict
    worst = max(verdict["exceeded"], key=lambda one: one["value"])
    assert worst in verdict["largest"] and worst["limit"] == "rim_force" and worst["unit"] == "N"


FIRST = ["ridgecrest-ccc", "ridgecrest-clc", "hospital-ccc", "hospital-clc", "fenz-test5"]  # that a user meets
PUBLISHED = [*presets.names("scene"), *presets.names("building"), *sorted((ROOT / "examples").glob("*.toml"))]


@pytest.mark.parametrize("name", thinned(PUBLISHED, lambda name: name in ("fenz-test5", "triple-push")), ids=str)
def test_no_published_design_is_blamed(name: str | Path) -> None:
    """Every preset and example, as it is, is within the limits that are not given; the first have no notes."""
    result = simulate(load_scene(name))
    verdict, stopped = result.verdict, result.status == "stopped"
    assert result.scene.limits is None and not verdict.exceeded and not verdict.failure, verdict.text
    assert verdict.word == ("stopped" if stopped else "within") and verdict.ok != stopped
    assert verdict.text.endswith("within the limits of the device")
    notes = [note for note in result.notes if note.kind != "vibration"]  # of the tolerance, not of the design
    assert name not in FIRST or (result.status == "ok" and not notes)


def test_a_rim_that_gives_way_is_no_rim() -> None:
    """Stiffness in kN/mm in place of N/m: the force of the rim stays small, and the slider passes it."""
    soft = changed_scene("fenz-test5", {"bearing.rim_stiffness": 10.0, "bearing.rim_damping": 0.0})
    result = simulate(soft)
    reading = result.verdict.worst["rim_compression"]
    assert [one.limit.key for one in result.verdict.exceeded] == ["rim_compression"]
    assert reading.value.reached == pytest.approx(-result.history.gap.min(), rel=1e-3) and reading.value.reached > 5e-3
    assert reading.value.allowed == pytest.approx(0.1 * soft.bearing.surfaces[0].capacity)
    texts = [note.text for note in result.notes if note.kind == "value"]
    assert len(texts) == 4 and "rim_stiffness = 10 N/m stops no slider" in texts[0] and "kN/mm" in texts[0]
    assert any("values that are hardly meant" in table.title for table in explain(soft))
    without = replace(soft, effects=Auto(rims=False, sliders="inertial"))
    assert not any("rim_stiffness" in text for _, _, text in scene_doubts(without))


def test_soft_rims_of_a_building_are_noted() -> None:
    made = scene(frame(), bearing=BEARING.replace(rim_stiffness=1e4), duration=0.1)
    noted = [note for note in simulate(made).notes if note.kind == "value"]
    assert noted and noted[0].bearing == 1
    assert all("rim_stiffness = 10000 N/m stops no slider" in note.text for note in noted)
    assert sum("stops no slider" in str(table.rows) for table in explain(made)) == 1


@pytest.mark.parametrize("limit", [None, Limits(displacement=2e-3)])
def test_a_run_that_met_its_stop_condition_is_not_within(limit: Limits | None) -> None:
    """What comes after is not known."""
    result = simulate(changed_scene("fenz-test2", {"stop": {"displacement": 5e-3}}))
    result = replace(result, scene=replace(result.scene, limits=limit))
    verdict, (event,) = result.verdict, [event for event in result.events if event.kind == "stop"]
    assert verdict.stopped == event.time < result.scene.end and not verdict.ok
    assert verdict.word == result.summary["verdict"]["word"] == ("stopped" if limit is None else "exceeded")
    assert f"the run met its stop condition at {event.time:.4g} s" in verdict.text
    assert verdict.text.endswith("until then within the limits of the device") == (limit is None)
    if limit is None:
        assert verdict.table.title == "limits of the device: within all until the stop condition"
        assert "Until then: within the limits of the device." in outcome(result)
    else:
        assert outcome(result).endswith(f"Limits of the device exceeded: {verdict.exceeded_text}.")


LIMITED = Limits(rim_force=12e3, uplift_height=1e-3, temperature=180.0, displacement=0.3)


@pytest.mark.parametrize("kind", ["bearing", "building"])
def test_limits_are_kept_in_files(kind: str, tmp_path: Path) -> None:
    whole: Any = preset_run("fenz-test5") if kind == "bearing" else at_the_rims()
    result = replace(whole, scene=replace(whole.scene, limits=LIMITED))
    read = load_result(result.to_netcdf(tmp_path / "run.nc"))
    assert read.scene.limits == LIMITED and read.verdict.as_dict == result.verdict.as_dict
    assert load_result(whole.to_netcdf(tmp_path / "other.nc")).scene.limits is None


def test_limits_are_no_part_of_the_identity(tmp_path: Path) -> None:
    """Neither of results nor of checkpoints: no number of a run depends on them."""
    given: list[Scene | BuildingScene] = [load_scene("fenz-test1"), replace(scene(frame()), duration=0.05)]
    for index, one in enumerate(given):
        limited, file = replace(one, limits=LIMITED), tmp_path / f"{index}.ckpt"
        assert fingerprint(limited) == fingerprint(one) and limited != one
        before = simulate(one, checkpoint=file)
        assert simulate(limited, checkpoint=file, resume=True).verdict.readings != before.verdict.readings


BAD = [
    ("rim_force = -1", "limits.rim_force = -1: give a finite number above 0 [N]"),
    ("rim_force = '5 mm'", "limits.rim_force = '5 mm': the unit 'mm' is not a unit of [N]"),
    ("uplift_height = 0", "limits.uplift_height = 0: give a finite number above 0 [m]"),
    ("uplift_duration = nan", "limits.uplift_duration = nan: give a finite number above 0 [s]"),
    ("temperature = -300", "limits.temperature = -300: give a finite number above -273.15 [degC]"),
    ("axial_load = true", "limits.axial_load = True: give a finite number above 0 [N]"),
    ("displacement = [1, 2]", "limits.displacement = [1, 2]: give a finite number above 0 [m]"),
    ("rimforce = 1", "limits.rimforce: unknown key; did you mean 'rim_force'?"),
    ("gap = 1", "limits.gap: unknown key; the keys here are rim_force, "),
]
BUILDING = (
    'building = { base = { mass = "45 t", inertia = [1e5, 1e5, 1e5] }, interface = { stiffness = 1e8, '
    "vertical_stiffness = 5e8, rotational_stiffness = 1e7 }, "
    'bearing = [{ bearing = "fenz-tfp", position = [0.0, 0.0] }] }\n'
    'motion = { kind = "harmonic", amplitude = 0.05, frequency = 0.6 }\n'
)


@pytest.mark.parametrize(("line", "message"), BAD)
@pytest.mark.parametrize("kind", ["bearing", "building"])
def test_bad_limits_are_one_line(kind: str, line: str, message: str, tmp_path: Path, capsys: Any) -> None:
    text = (ROOT / "examples" / "triple.toml").read_text(encoding="utf-8") if kind == "bearing" else BUILDING
    (tmp_path / "scene.toml").write_text(f"{text}\n[limits]\n{line}\n", encoding="utf-8")
    assert main(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out.nc")]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.splitlines()) == 1 and not (tmp_path / "out.nc").exists()


def test_limits_of_a_file_and_of_python() -> None:
    with pytest.raises(InputError, match=r"limits\.rim_force = -1\.0: give a finite number above 0 \[N\]"):
        Limits(rim_force=-1.0)
    with pytest.raises(InputError, match=r"scene\.limits = .*: give a Limits"):
        replace(load_scene("fenz-test1"), limits={"rim_force": 1.0})
    with pytest.raises(InputError, match=r"scene\.limits = 3: give a Limits"):
        replace(scene(frame()), limits=3)  # type: ignore[arg-type]
    changed = changed_scene("fenz-test1", {"limits.rim_force": "12 kN"})
    assert changed.limits == Limits(rim_force=12e3)
    assert changed_scene("hospital-ccc", {"limits.axial_load": 3e6}).limits == Limits(axial_load=3e6)


@pytest.mark.parametrize("given", [load_scene("fenz-test1"), scene(frame())], ids=["bearing", "building"])
def test_explain_has_the_limits_that_are_given(given: Scene | BuildingScene) -> None:
    tables = [table for table in explain(replace(given, limits=LIMITED)) if "limits" in table.title]
    assert [row[0] for row in tables[0].rows] == [
        "rim_force",
        "uplift_height",
        "uplift_duration",
        "temperature",
        "displacement",
    ]
    assert tables[0].rows[0][1] == "12000 N" and not [t for t in explain(given) if "limits" in t.title]


def test_what_a_limit_of_zero_does_not_allow_governs() -> None:
    value = ReachedValue(1, 0.0, 0.0, 0.0)
    shares = [LimitReading(LIMITS[0], 0, "", value._replace(reached=reached)).share for reached in (0.0, 1e-6, 2.0)]
    assert shares == [0.0, np.inf, np.inf]
