"""What a run is not asked for is not made, and what belongs to a motion is made once."""

import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from support import ROOT, scene_of
from support.resuming import assert_same

from msfp_gen import simulate
from msfp_gen.motions.motion import Motion
from msfp_gen.simulation import bearing_run, memory

MAKERS = ("history_of", "history_notes", "landing_notes")


@pytest.fixture
def asked(monkeypatch):
    """Names of the functions that make parts of a result, in the order of their calls."""
    calls = []
    for name in MAKERS:
        made = getattr(bearing_run, name)

        def noted(*values, name=name, made=made):
            calls.append(name)
            return made(*values)

        monkeypatch.setattr(bearing_run, name, noted)
    return calls


def test_a_result_makes_history_and_notes_when_they_are_asked_for(asked):
    scene = scene_of("fenz-test2")
    result = simulate(scene)
    assert result.succeeded and result.counters.steps and result.recorded_extremes is not None
    assert not asked
    sent = pickle.loads(pickle.dumps(result))  # to another process, without history and notes
    assert not asked
    history = result.history
    assert result.history is history and asked == ["history_of"]
    assert result.notes is result.notes and asked == list(MAKERS)
    assert_same(result, sent)
    assert sent.notes == result.notes and sent.summary == result.summary


def test_a_motion_is_evaluated_for_its_first_run_alone(monkeypatch):
    scene = scene_of("fenz-test2")
    first = simulate(scene)
    calls = []
    evaluate = Motion.evaluate
    monkeypatch.setattr(Motion, "evaluate", lambda *given: calls.append(given) or evaluate(*given))
    softer = replace(scene, bearing=scene.bearing.replace(friction=[0.9 * s.friction for s in scene.bearing.surfaces]))
    second = simulate(softer)
    assert not calls
    moved = replace(softer, motion=pickle.loads(pickle.dumps(scene.motion)))  # nothing is kept with a copy
    assert_same(second, simulate(moved))
    assert calls
    assert np.abs(first.history.top_force[:, 0]).max() > np.abs(second.history.top_force[:, 0]).max()


def test_the_memory_is_not_read_for_few_rows(monkeypatch):
    scene = scene_of("fenz-test2")
    read, available = [], memory.available
    monkeypatch.setattr(memory, "available", lambda: read.append(True) or available())
    simulate(scene)
    simulate(replace(scene, output_step=0.01))
    assert not read
    memory.require_memory([replace(scene, output_step=scene.end / 1e6)])
    assert read


def test_an_entry_of_the_summary_needs_no_other(asked, monkeypatch):
    whole = simulate(scene_of("fenz-test2")).summary
    asked.clear()
    with monkeypatch.context() as patch:
        patch.setattr("msfp_gen.results.result.verdict_of", lambda *_: pytest.fail("the verdict was made"))
        result = simulate(scene_of("fenz-test2"))
        for key in ("peak_displacement", "peak_force", "peak_sliding", "rims_met"):
            assert result.entry(key) == whole[key]
    assert asked == ["history_of"]
    assert result.entry("verdict") == whole["verdict"]
    assert {key: result.entry(key) for key in whole if "time" not in key} == {
        key: value for key, value in whole.items() if "time" not in key
    }
    assert result.entry("none") is None


def test_the_first_run_of_a_process_imports_no_masked_arrays():
    """Nor what reads files, draws figures or derives equations: `np.unique` and `np.median` import the former."""
    code = (
        "import sys; from msfp_gen import load_scene, simulate; simulate(load_scene('fenz-test2')); print(*sys.modules)"
    )
    modules = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    unwanted = {"numpy.ma", "sympy", "xarray", "h5py", "matplotlib", "scipy", "pint", "pandas", "pyarrow", "Cython"}
    assert not unwanted & set(modules.split())
