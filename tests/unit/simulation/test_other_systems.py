"""A system of a kind that the package does not know runs like any other, from a file too, by an entry point."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from msfp_gen import (
    InputError,
    Motion,
    Scene,
    Solver,
    animate,
    load_result,
    load_scene,
    simulate,
    simulate_batch,
    study,
)
from msfp_gen.auditing.histories import histories_of
from msfp_gen.cli import main
from msfp_gen.report import write_report
from msfp_gen.report.frames import view
from msfp_gen.report.page import BEARING
from msfp_gen.results.dataset import columns
from msfp_gen.results.quantities import quantities
from msfp_gen.results.result import AnyResult, Result
from msfp_gen.scene.explain import explain
from msfp_gen.scene.file import catalogue
from msfp_gen.scene.file.changes import changed_table
from msfp_gen.scene.file.loader import NO_PARTS, bearing_tables, scene_from_table, scene_text
from msfp_gen.scene.system import GROUP, Kind, OtherSystem, kinds
from msfp_gen.simulation.bearing_run import BearingRun, start_bearing
from msfp_gen.studies import read_study
from msfp_gen.studies.accuracy import simulate_within
from msfp_gen.studies.accuracy.timed_run import errors, run_native
from msfp_gen.studies.columns import Keep


@dataclass(frozen=True)
class Pair(OtherSystem):
    """Two equal bearings that share a load: the scene of one of them under half of it."""

    whole: Scene
    motion: Motion
    name: str = "pair"
    fidelity: str = "exact"
    run_options = frozenset({"strict"})

    @property
    def half(self) -> Scene:
        top = replace(self.whole.top, axial_load=self.whole.top.axial_load / 2)
        return replace(self.whole, top=top, motion=self.motion, name=self.name)

    end = property(lambda self: self.half.end)
    solver = property(lambda self: self.half.solver)
    limits = property(lambda self: self.half.limits)
    specs = property(lambda self: self.half.specs)
    every_bearing = property(lambda self: (self.whole.bearing,) * 2)

    def start(self, **options: Any) -> Any:
        return PairRun(self, start_bearing(self.half, **options))

    def explain(self) -> list[Any]:
        return explain(self.half)

    def text(self) -> str:
        return scene_text(self.half)

    def quantities(self) -> dict[str, Any]:
        return quantities(self.half)

    def columns(self) -> dict[str, Any]:
        return columns(self.half)


@dataclass(eq=False)
class PairRun:
    """The run of one of them, with the result of the pair."""

    pair: Pair
    run: BearingRun

    def __getattr__(self, name: str) -> Any:
        return getattr(self.run, name)

    def result(self, with_initial_row: bool = False) -> Any:
        half = self.run.result(with_initial_row)
        return PairResult(self.pair, half, half.provenance)


@dataclass(frozen=True, eq=False, repr=False)
class PairResult(AnyResult):
    """The result of a pair: its peak force is twice the one of each bearing."""

    scene: Pair
    half: Result
    provenance: dict[str, str]
    source = "pair"
    storage = replace(
        Result.storage,
        to_dataset=lambda result: result.half.dataset.assign_attrs(source="pair"),
        arrays_of=lambda result: Result.storage.arrays_of(result.half),
        groups_of=lambda _: {},
    )
    status, message, notes, time, work, compared, curve = (
        property(attrgetter(f"half.{name}"))
        for name in ("status", "message", "notes", "time", "work", "compared", "curve")
    )
    bearings = property(lambda self: (self.half, self.half))
    page = property(lambda self: PAGE)

    @cached_property
    def summary(self) -> dict[str, Any]:
        own = self.half.summary
        return own | {"peak_force": {axis: 2 * force for axis, force in own["peak_force"].items()}}

    def at_times(self, times: Any) -> Any:
        return replace(self, half=self.half.at_times(times))

    def characterise(self) -> Any:
        return self.half.characterise()

    def main_results(self) -> Any:
        return [("peak force of both", f"{1e-3 * self.summary['peak_force']['radial']:.4g} kN")]

    def part_tables(self) -> Any:
        return self.half.part_tables()


PAGE = BEARING._replace(
    name="pair",
    introduction=lambda result: f"Simulation of {len(result.bearings)} equal bearings",
    figures={},
    view=lambda result, count: view(result.half, count),
)


def pair_from_table(table: Mapping[str, Any], folder: Path | None = None, parts: Mapping[str, Any] = NO_PARTS) -> Pair:
    inner = {key: value for key, value in table.items() if key != "pair"} | dict(table["pair"])
    scene = scene_from_table(inner, folder, parts)
    return Pair(scene, scene.motion, scene.name)


PAIR = Kind("pair", pair_from_table, lambda _: iter(()))
TABLE = """
name = "two"
[pair]
bearing = "fenz-tfp"
top = { kind = "rig", axial_load = 224e3, stiffness = 1e8, damping = 5.0, rotational_stiffness = 1e6 }
[motion]
kind = "harmonic"
amplitude = 0.02
frequency = 0.5
cycles = 1
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A scene file of a pair, whose kind an installed package offers."""
    about = tmp_path / "pairs-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: pairs\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\npair = pairs:PAIR\n")
    monkeypatch.setitem(sys.modules, "pairs", sys.modules[__name__])
    monkeypatch.syspath_prepend(str(tmp_path))
    kinds.cache_clear()
    path = tmp_path / "pair.toml"
    path.write_text(TABLE)
    yield path
    kinds.cache_clear()


def test_a_third_kind_runs_through_everything(file: Path, tmp_path: Path) -> None:
    pair = load_scene(file)
    assert isinstance(pair, Pair) and "pair" in catalogue.words_of_presets()
    result = simulate(pair, strict=True)
    alone = simulate(pair.half)
    assert isinstance(result, PairResult) and result.scene is pair
    assert np.array_equal(result.half.history.top_force, alone.history.top_force)
    assert result.summary["peak_force"]["radial"] == 2 * alone.summary["peak_force"]["radial"]
    (again,) = simulate_batch([pair])
    assert isinstance(again, PairResult) and again.summary["peak_force"] == result.summary["peak_force"]
    checkpoint = tmp_path / "pair.ck"
    simulate(pair, checkpoint=checkpoint)
    resumed = simulate(pair, checkpoint=checkpoint, resume=True)
    assert np.array_equal(resumed.half.history.top_force, result.half.history.top_force)
    with pytest.raises(InputError, match=r"no result of msfp-gen"):  # its file is for other programs
        load_result(result.save(tmp_path / "pair.nc"))
    with pytest.raises(InputError, match="two: results of this kind have no movie; their rows are in"):
        animate(result, tmp_path / "pair.gif")
    with pytest.raises(InputError, match="no run of one bearing alone"):
        histories_of(result)
    page = write_report(result, tmp_path / "pair.html").read_text(encoding="utf-8")
    assert all(words in page for words in ("triple friction pendulum", "The pair in motion", "of 2 equal bearings"))
    axes = {"load": {"sets": "pair.top.axial_load", "values": [224e3, 112e3]}}
    reach = {"reach": "peak(displacement_E1)"}
    study({"scene": str(file), "axes": axes, "keep": ["peak_force"], "quantities": reach}, tmp_path / "out")
    table = read_study(tmp_path / "out")
    assert table["reach"][0] == np.abs(result.half.history.displacement[:, 0]).max()
    assert table["peak_force"][0] == pytest.approx(result.summary["peak_force"]["radial"], rel=1e-12)
    assert table["peak_force"][1] < 0.6 * table["peak_force"][0]


SOLVER = Solver()


@dataclass(frozen=True)
class Tunable(Pair):
    """A pair whose method and tolerances can be chosen."""

    solver: Any = SOLVER

    @property
    def half(self) -> Scene:
        return replace(super().half, solver=self.solver)


def test_errors_of_a_third_kind_are_those_of_its_bearing(file: Path) -> None:
    """Its rows are the steps of each run, at other times in each: they are compared at the fewer ones."""
    pair = load_scene(file)
    tunable = Tunable(pair.whole, pair.motion)
    for rtol in (1e-2, 1e-3):
        trials, alone = (
            [run_native("implicit", system, each, 60.0, repeats=0) for each in (rtol, 1e-7)]
            for system in (tunable, pair.half)
        )
        found, want = errors(*trials), errors(*alone)
        assert found is not None and want is not None
        assert found.parts["force"].rms == pytest.approx(want.parts["force"].rms, rel=0.5)
        assert found.parts["force"].peak == pytest.approx(want.parts["force"].peak, abs=2e-3)
    within = simulate_within(tunable, 0.05)
    assert within.estimate < 0.05 and within.result.succeeded


@dataclass(frozen=True)
class Bare(OtherSystem):
    """A system with no more than it must have."""

    whole: Scene
    name: str = "bare"
    motion = property(lambda self: self.whole.motion)
    end = property(lambda self: self.whole.end)
    specs = property(lambda self: self.whole.specs)
    every_bearing = property(lambda self: self.whole.every_bearing)
    limits = fidelity = None

    def start(self, **options: Any) -> Any:
        return start_bearing(self.whole, **options)


BARE = Kind("pair", lambda *args: Bare(pair_from_table(*args).half), lambda _: iter(()))


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (("run", "--checkpoint", "c.ck"), "bare: this system cannot be written as a scene file; leave the file out"),
        (("run", "--duration", "1"), "bare: this system has no field duration; leave out the options that change it"),
        (("bench", "model-error", "--duration", "1"), "bare: this system has no field duration; leave out the options"),
        (("run", "--rtol", "1e-3"), "bare: this system has no field solver; leave out the options that change it"),
        (("run", "--error", "5%"), "bare: this system has no field solver; no error can be measured without it"),
        (("plot", "--figure", "all", "-o", "figures"), "--figure = 'all': this system has no figures; its rows are in"),
        (("plot", "-o", "p.png"), "--figure = 'overview': this system has no figures; its rows are in"),
        (("bound", "-o", "b"), "this system has no bearings that can be changed"),
        (("fmu", "-o", "b"), "this is not one bearing alone; give a scene of one bearing here"),
    ],
)
def test_what_a_kind_does_not_define_is_one_line(
    file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: tuple[str, ...],
    message: str,
) -> None:
    monkeypatch.setattr(sys.modules[__name__], "PAIR", BARE)
    monkeypatch.chdir(file.parent)
    kinds.cache_clear()
    words = 2 if command[0] == "bench" else 1
    assert main([*command[:words], str(file), *command[words:]]) == 2
    error = capsys.readouterr().err
    assert message in error and len(error.strip().splitlines()) == 1
    assert not [path for path in file.parent.iterdir() if path.name in ("c.ck", "figures", "p.png", "b")]


def test_a_kind_of_a_dozen_lines_runs_through_everything(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules[__name__], "PAIR", BARE)
    kinds.cache_clear()
    bare = load_scene(file)
    result = simulate(bare)
    assert np.array_equal(result.history.top_force, simulate(bare.whole).history.top_force)
    (again,) = simulate_batch([bare])
    assert again.summary["peak_force"] == result.summary["peak_force"]
    assert write_report(result, tmp_path / "bare.html").is_file() and main(["explain", str(file)]) == 0
    axes = {"load": {"sets": "pair.top.axial_load", "values": [224e3, 112e3]}}
    study({"scene": str(file), "axes": axes, "keep": []}, tmp_path / "out")
    assert list(read_study(tmp_path / "out")["status"]) == ["ok", "ok"]


def test_a_kind_names_the_table_of_its_bearings(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[__name__], "PAIR", replace(PAIR, named="devices"))
    kinds.cache_clear()
    table = {"pair": {"bearing": "corner"}, "devices": {"corner": {"preset": "fenz-tfp"}, "edge": "fenz-dp"}}
    changed = changed_table(table, {"pair.bearing.friction": 0.1})
    assert changed["pair"]["bearing"] == {"preset": "fenz-tfp", "friction": 0.1}
    assert bearing_tables(table) == {"corner": {"preset": "fenz-tfp"}}


def test_what_it_has_not_is_one_line(file: Path) -> None:
    pair = load_scene(file)
    with pytest.raises(InputError, match="threads: the run of this scene has no such option"):
        simulate(pair, threads=2)
    with pytest.raises(InputError, match="pair: unknown key"):
        kinds.cache_clear()
        sys.path.remove(str(file.parent))
        load_scene(file)


@dataclass(frozen=True, eq=False, repr=False)
class Plain(PairResult):
    """A result of a kind that draws no page."""

    page = AnyResult.page


def test_a_result_without_a_page_and_a_system_without_quantities_are_one_line(file: Path, tmp_path: Path) -> None:
    result = simulate(load_scene(file))
    with pytest.raises(InputError, match="two: results of this kind have no report; their rows are in"):
        write_report(Plain(result.scene, result.half, {}), tmp_path / "pair.html")
    with pytest.raises(InputError, match=r"'peak_force' is no quantity; this system has none; give keep = \[\]"):
        _ = Keep(names=("peak_force",), formulas=(), axes=()).columns


def test_an_error_cannot_be_asked_without_a_tolerance(file: Path) -> None:
    with pytest.raises(InputError, match="two: this system has no field solver"):
        simulate_within(load_scene(file), 0.01)
