"""Many scenes at once: what a run is in a lane, it is alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import scene_of

from msfp_gen import Auto, Effects, InputError, RunError, Scene, load_scene, simulate, simulate_batch
from msfp_gen.batch import Queue
from msfp_gen.cli import main
from msfp_gen.lanes import VARIABLE, alone_because, chosen_width, widths_here
from msfp_gen.result import Result
from msfp_gen.scenefile import changed_scene
from msfp_gen.varied import varied_field, varied_scenes

pytestmark = pytest.mark.skipif(not widths_here(), reason="no lanes on this machine")
WIDTHS = widths_here()
EXACT = "-DMSFP_EXACT -ffp-contract=off -fno-reciprocal-math"


def alone(scene: Scene) -> Result:
    """What `simulate` makes of a scene, also where it fails."""
    try:
        return simulate(scene)
    except RunError as error:
        assert isinstance(error.result, Result)
        return error.result


def apart(one: Result, other: Result) -> float:
    """Largest difference of horizontal force over the largest; both at the same even times, but for a stop."""
    x, y = one.history, other.history
    rows = min(len(x.time), len(y.time)) - (one.status == "stopped")
    assert np.allclose(x.time[:rows], y.time[:rows], rtol=0, atol=1e-9)
    return float(np.abs(x.top_force[:rows, :2] - y.top_force[:rows, :2]).max() / np.abs(y.top_force[:, :2]).max())


@cache
def mixed() -> tuple[Scene, ...]:
    """Cyclic tests, orbits and a record of unlike lengths and tolerances; with rims met; all of one model."""
    names = ("fenz-test1", "becker-circle-50", "fenz-test2", "fenz-test5", "fenz-monotonic")
    scenes = [load_scene(name) for name in names]
    scenes += [scene_of("fenz-test2", solver={"rtol": rtol}, output_step=0.5) for rtol in (1e-2, 1e-3, 1e-5)]
    scenes += [replace(load_scene("ridgecrest-clc"), duration=seconds) for seconds in (2.0, 5.0, 8.0)]
    scenes.append(scene_of("becker-eight-125", solver={"method": "esdirk4"}))
    scenes.append(scene_of("fenz-test3", solver={"max_steps": 40}))
    return tuple(replace(scene, output_step=scene.output_step or scene.end / 200) for scene in scenes)


@pytest.mark.parametrize("width", WIDTHS)
def test_same_answers_as_alone_for_every_width(width: int) -> None:
    results = simulate_batch(mixed(), lanes=width)
    for scene, result in zip(mixed(), results, strict=True):
        expected = alone(scene)
        assert result.scene is scene and result.provenance["batch"] == f"{width} lanes"
        assert (result.status, result.message) == (expected.status, expected.message) or result.status == "steps"
        assert [event.kind for event in result.events] == [event.kind for event in expected.events]
        if result.succeeded:
            assert result.history.time[-1] == pytest.approx(expected.history.time[-1], abs=1e-4)
            assert apart(result, expected) < 30 * scene.solver.rtol  # as far apart as two runs of this tolerance may be
    assert results[-1].status == "steps" and 1.0 < results[-1].history.time[-1] < 10.0


PROGRAM = """
import sys; sys.path.insert(0, {tests!r})
import numpy as np
from test_batch import alone, mixed
from msfp_gen import simulate_batch
from msfp_gen.scenefile import changed_scene
from support import scene_of
names = ("fenz-test2", "fenz-test5", "fenz-test1", "fenz-test4")
planar = [scene_of(n, dict(dimension="planar")) for n in names]
light = [scene_of(n, dict(sliders="massless", rims=False)) for n in (*names, "becker-circle-50")]
failing = [changed_scene("ridgecrest-clc", {{"motion.scale": scale}}) for scale in (6.0, 8.0)]
scenes = [*mixed(), *failing, *planar, *light]
for scene, one in zip(scenes, simulate_batch(scenes, lanes={width})):
    other = alone(scene)
    assert one.provenance["batch"] == "{width} lanes", one.provenance
    assert one.status == other.status and one.message == other.message, (scene.name, one.message, other.message)
    for name in ("time", "tilt_angles", "tilt_rates", "tilt_accelerations", "friction_state", "top_force"):
        assert np.array_equal(getattr(one.history, name), getattr(other.history, name)), (scene.name, name)
    for name in one.history.energy:
        assert np.array_equal(one.history.energy[name], other.history.energy[name]), (scene.name, name)
    a, b = vars(one.counters) | dict(wall_time=0), vars(other.counters) | dict(wall_time=0)
    assert a == b, (scene.name, a, b)
    assert [e.time for e in one.events] == [e.time for e in other.events]
print("same")
"""


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_bit_by_bit_where_the_compiler_may_not_round_otherwise(width: int) -> None:
    """With the library's sines and no fused operations, a lane makes every number that a run alone makes."""
    program = PROGRAM.format(tests=str(Path(__file__).parent), width=width)
    done = subprocess.run([sys.executable, "-c", program], env={**os.environ, "MSFP_GEN_CFLAGS": EXACT}, text=True,
                          capture_output=True)  # fmt: skip
    assert done.stdout == "same\n", done.stderr


def test_lanes_are_refilled_and_order_is_kept() -> None:
    rtols = np.geomspace(1e-2, 1e-4, 40)
    scenes = [scene_of("fenz-test1", solver={"rtol": float(rtol)}) for rtol in rtols]
    told: list[tuple[int, int]] = []
    results = simulate_batch(iter(scenes), progress=lambda done, count: told.append((done, count)))
    assert [result.scene.solver.rtol for result in results] == list(rtols)
    assert told == [(done, 40) for done in range(1, 41)]
    steps = [result.counters.steps for result in results]
    assert steps[0] < steps[-1] and all(result.succeeded and result.counters.wall_time > 0 for result in results)


def test_a_failure_in_one_lane_leaves_the_others_as_they_are() -> None:
    good = [scene_of("fenz-test2", solver={"rtol": rtol}, output_step=0.2) for rtol in (1e-3, 5e-4, 2e-4, 1e-4)]
    broken = [changed_scene("ridgecrest-clc", {"motion.scale": 8.0})] * 4
    together = simulate_batch([scene for pair in zip(good, broken, strict=True) for scene in pair])
    expected = alone(broken[0])
    for one, other in zip(together[0::2], map(alone, good), strict=True):
        assert one.succeeded and apart(one, other) < 30 * one.scene.solver.rtol
    for result in together[1::2]:
        assert result.status == expected.status == "uplift"
        assert result.history.time[-1] == pytest.approx(expected.history.time[-1], abs=1e-3)
        assert "stopped at t =" in result.message and "give effects.uplift = true" in result.message


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"effects": {"uplift": True}}, "bodies may part"),
        ({"solver": {"method": "dopri5", "rtol": 1e-3}, "duration": 0.01}, "dopri5 evaluates other equations"),
    ],
)
def test_what_lanes_cannot_do_runs_one_at_a_time_and_says_so(change: dict[str, Any], reason: str) -> None:
    scenes = [scene_of("fenz-test1", **change)] * 5
    results = simulate_batch(scenes)
    expected = alone(scenes[0])
    for result in results:
        assert result.provenance["batch"] == f"one at a time: {reason}"
        assert np.array_equal(result.history.top_force, expected.history.top_force)


def test_few_scenes_and_no_lanes_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene("fenz-test1")
    assert simulate_batch([scene])[0].provenance["batch"] == "one at a time: too few scenes of its model"
    assert simulate_batch([]) == []
    monkeypatch.setenv(VARIABLE, "0")
    assert simulate_batch([scene] * 9)[-1].provenance["batch"] == "one at a time: no lanes here, or none asked for"
    assert alone_because(Effects(friction="pv"), "implicit") == "friction follows a law"


def test_scenes_that_go_on_with_a_wider_model() -> None:
    """Effects chosen from the scene: a planar start, then whatever a watch asks for; lanes for every part."""
    record = load_scene("ridgecrest-clc")
    chosen = replace(record, effects=Auto(), output_step=0.01)
    scenes = [replace(chosen, duration=seconds) for seconds in (3.0, 4.0, 5.0, 6.0, 7.0)]
    for result, expected in zip(simulate_batch(scenes), map(alone, scenes), strict=True):
        assert result.status == expected.status
        assert result.provenance["model"] == expected.provenance["model"]
        assert [note.kind for note in result.notes] == [note.kind for note in expected.notes]
        assert apart(result, expected) < 30 * result.scene.solver.rtol


@pytest.mark.parametrize("lanes", [None, 0])
def test_workers_share_a_queue(lanes: int | None) -> None:
    rtols = [float(rtol) for rtol in np.geomspace(1e-2, 1e-4, 24)]
    scenes = [scene_of("fenz-test1", solver={"rtol": rtol}, output_step=0.1) for rtol in rtols]
    together, one = simulate_batch(scenes, workers=2, lanes=lanes), simulate_batch(scenes, lanes=lanes)
    for a, b in zip(together, one, strict=True):
        assert a.succeeded and apart(a, b) < 30 * a.scene.solver.rtol


def test_an_interruption_ends_the_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Queue, "ended", interrupted)
    with pytest.raises(KeyboardInterrupt):
        simulate_batch([load_scene("fenz-test1")] * 8)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda scene: simulate_batch(scene), "scenes: this is one scene; give a list"),
        (lambda scene: simulate_batch([scene, "fenz-test2"]), "scenes[1]: a str is no scene; give what load_scene"),
        (lambda scene: simulate_batch([scene], workers=0), "workers = 0: give a whole number of threads"),
        (lambda scene: simulate_batch([scene], lanes=3), "lanes = 3: give 8, 4 or 2 runs side by side, or 0"),
        (lambda scene: simulate_batch([scene, replace(scene, effects=Effects(sliders="massless"),
                                                     solver=replace(scene.solver, method="dopri5"))]),
         "scenes[1]: solver.method = 'dopri5': massless sliders"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_before_anything_runs(call: Any, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("msfp_gen.batch.build_model", None)
    with pytest.raises(InputError) as caught:
        call(load_scene("fenz-test1"))
    assert words in str(caught.value)


def test_the_width_is_that_of_the_processor_or_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = {"x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
            "x86-64-v3": {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}}  # fmt: skip
    for flags, widths, width in (
        (seen["x86-64-v4"] | seen["x86-64-v3"], (8, 4, 2), 8), (seen["x86-64-v3"], (4, 2), 4), (set(), (2,), 0),
    ):  # fmt: skip
        monkeypatch.setattr("msfp_gen.lanes.processor", lambda flags=flags: frozenset(flags))
        assert (widths_here(), chosen_width(None)) == (widths, width)
    with pytest.raises(InputError, match="lanes = 8: this machine has 2; give one of these"):
        chosen_width(8)
    monkeypatch.setenv(VARIABLE, "2")
    assert chosen_width(None) == 2 and chosen_width(0) == 0
    monkeypatch.setenv(VARIABLE, "many")
    with pytest.raises(InputError, match="MSFP_GEN_LANES = 'many': give 8, 4 or 2"):
        chosen_width(None)


def test_fields_take_several_values() -> None:
    fields = [varied_field("solver.rtol=1e-3, 1e-4"), varied_field("bearing.gravity = 9.81, 9.8")]
    scenes = varied_scenes("fenz-test2", fields)
    values = [(scene.solver.rtol, scene.bearing.gravity) for scene in scenes]
    assert values == [(1e-3, 9.81), (1e-3, 9.8), (1e-4, 9.81), (1e-4, 9.8)]
    assert scenes[1].name == "fenz-test2, solver.rtol = 0.001, bearing.gravity = 9.8"
    assert varied_scenes("fenz-test2", []) == [load_scene("fenz-test2")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("motion.scale", "--vary = 'motion.scale': give a field of the scene and its values"),
        ("motion.scale=1,,2", "the values are no TOML"),
        ("motion.scale=", "there are no values"),
        (".=1", "give a field of the scene"),
        ("solver.rtool=1e-3", "solver.rtool: unknown key"),
        ("name.x=1", "name.x = 1: name is 'fenz-test1' here, which has no fields to change"),
        ("solver.rtol=2", "solver.rtol"),
    ],
)
def test_fields_that_are_none(text: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "fenz-test1", "--vary", text]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and words in err


def test_the_command(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "runs"
    assert main(["batch", "fenz-test1", "fenz-test2", "--vary", "solver.rtol=1e-2,1e-3", "-o", str(folder)]) == 0
    out, err = capsys.readouterr()
    assert "4 runs" in out and "fenz-test2, solver.rtol = 0.001" in out and "lanes" in out
    names = sorted(path.name for path in folder.iterdir())
    assert names[0] == "1-fenz-test1-solver.rtol=0.01.nc" and len(names) == 4 and err.count("wrote ") == 4
    assert Result.from_netcdf(folder / names[3]).scene.solver.rtol == 1e-3
    assert main(["batch", "fenz-test1", "--json", "--lanes", "0"]) == 0
    assert [run["status"] for run in json.loads(capsys.readouterr().out)] == ["ok"]


def test_the_command_says_what_failed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["batch", "fenz-test1", "--vary", "solver.max_steps=5,100000"]) == 1
    out, err = capsys.readouterr()
    assert "steps" in out and "error: 1 of 2 runs did not reach their end; the first: fenz-test1" in err


SINES = r"""
#include <stdio.h>
#include "lane.h"
static double ulps(double got, long double expected)
{
    int exponent;
    frexp((double)expected, &exponent);
    return (double)(fabsl((long double)got - expected) / ldexpl(1.0L, exponent - 53));
}
int main(void)
{
    double worst[3] = { 0.0 }, state = 0.5;
    const double reach[3] = { 0.785, 10.0, 9.9e4 };
    for (int range = 0; range < 3; ++range)
        for (int n = 0; n < 200000; ++n) {
            lane x, s, c;
            LANES_ALL {
                state = state * 3.99 * (1.0 - state); /* anywhere in (0, 1) */
                x[lane_index] = (2.0 * state - 1.0) * reach[range];
            }
            s = lane_sin(x);
            c = lane_cos(x);
            LANES_ALL {
                const long double exact = x[lane_index];
                const double off = fmax(ulps(s[lane_index], sinl(exact)), ulps(c[lane_index], cosl(exact)));
                worst[range] = fmax(worst[range], off);
            }
        }
    lane odd = lane_of(0.0);
    odd[1] = -1.6e5;
    const lane s = lane_sin(odd), c = lane_cos(odd), none = lane_sin(lane_of(NAN));
    const int ends = s[0] == 0.0 && c[0] == 1.0 && isnan(s[1]) && isnan(c[1]) && isnan(none[0]);
    printf("%g %g %g %d\n", worst[0], worst[1], worst[2], ends);
    return 0;
}
"""


@pytest.mark.parametrize("width", WIDTHS)
def test_sines_of_lanes_are_within_units_in_the_last_place(width: int, tmp_path: Path) -> None:
    from msfp_gen.cache import PACKAGE
    from msfp_gen.compiler import FLAGS, LANES, find_compiler

    (tmp_path / "sines.c").write_text(SINES)
    flags = [*FLAGS["c"], *FLAGS["lanes"], *LANES[width], f"-DMSFP_WIDTH={width}", f"-I{PACKAGE / 'runtime' / 'lanes'}"]
    subprocess.run([*find_compiler().command, *flags, "sines.c", "-o", "sines", "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "sines"], text=True, capture_output=True, check=True)
    small, usual, large, ends = done.stdout.split()
    assert float(small) < 1.2 and float(usual) < 2.0 and float(large) < 3.0 and ends == "1"


MODELS = (Effects(spin="patch"), Effects(dimension="planar", bouc_wen="isotropic"), Effects(spin="free", rims=False),
          Effects(sliders="massless", top_rotation=True))  # fmt: skip


@pytest.mark.parametrize("effects", MODELS, ids=str)
def test_the_c_of_a_batch_compiles_without_a_warning(effects: Effects, tmp_path: Path) -> None:
    from msfp_gen.build import runtime_sources
    from msfp_gen.compiler import FLAGS, LANES, find_compiler
    from msfp_gen.generator import generate
    from msfp_gen.layout import Layout, ModelSpec

    for name, text in (runtime_sources(8) | generate(ModelSpec(Layout.tfp(), effects), "model", True).files).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    for width, more in LANES.items():
        flags = [*FLAGS["c"], *FLAGS["lanes"], *more, f"-DMSFP_WIDTH={width}", "-Werror", "-fsyntax-only"]
        units = ["lanes.c", "batch.c", "newton.c", "condensed.c"]
        done = subprocess.run([*find_compiler().command, *flags, *units], cwd=tmp_path, text=True, capture_output=True)
        assert done.stderr == ""
