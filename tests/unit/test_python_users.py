"""What people do with scenes and results in Python: draw the dataset, write scenes, send things to other processes."""

from __future__ import annotations

import pickle
import subprocess
import sys
import time
import tomllib

import matplotlib.pyplot as plt
import numpy as np
from support import ROOT, preset_run

from msfp_gen import CompileError, Effects, InputError, Layout, RunError, build_model, load_scene, presets
from msfp_gen.motions.records import ScaleTo, baseline_corrected, bundled, response_spectrum
from msfp_gen.results.geometry import poses
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.studies.bounding import load_factors

NAME = "fenz-test1"
EXAMPLES = ROOT / "examples"
SCENE = load_scene(NAME)
PARTS = [
    SCENE,
    SCENE.bearing,
    SCENE.bearing.surfaces[0],
    SCENE.bearing.bodies[0],
    SCENE.motion,
    SCENE.top,
    SCENE.effects,
    SCENE.solver,
    SCENE.spec,
    SCENE.bearing.layout,
    load_scene("fenz-monotonic").stop,
]


def again(value):
    return pickle.loads(pickle.dumps(value))


def test_inputs_are_pickled():
    for part in PARTS:
        assert again(part) == part


def test_results_are_pickled_with_and_without_their_dataset():
    result = preset_run(NAME)
    for _ in range(2):
        copy = again(result)
        assert copy.scene == result.scene and copy.dataset.identical(result.dataset)  # the second time it is there
        assert copy.summary == result.summary


def test_what_is_made_of_results_and_records_is_pickled():
    """A pool of processes sends any of these back."""
    result, record = preset_run(NAME), bundled("ridgecrest-2019-ci-clc")
    found, spectrum = result.characterise(), response_spectrum(record, [0.5, 2.0])
    assert again(found).as_dict() == found.as_dict()
    np.testing.assert_array_equal(again(spectrum).psa, spectrum.psa)
    np.testing.assert_array_equal(again(record).acceleration, record.acceleration)
    corrected = baseline_corrected(record, duration=20.0)
    np.testing.assert_array_equal(again(corrected).displacement, corrected.displacement)
    np.testing.assert_array_equal(again(poses(result)).top, poses(result).top)
    table = load_factors("asce7")
    assert again(table) == table and again(ScaleTo(pga=4.0)) == ScaleTo(pga=4.0)
    assert again(load_scene("ridgecrest-clc").motion) == load_scene("ridgecrest-clc").motion


def test_errors_keep_what_they_carry():
    failed = again(RunError("t = 3 s", status="newton", result=preset_run(NAME)))
    assert (str(failed), failed.status, failed.result.status) == ("t = 3 s", "newton", "ok")
    refused = again(CompileError("no cc", command="cc x.c", output="not found"))
    assert (str(refused), refused.command, refused.output, refused.log) == ("no cc", "cc x.c", "not found", None)
    assert str(again(InputError("radius = 0"))) == "radius = 0"


def test_a_model_is_pickled_as_what_it_models():
    model = build_model(Layout.dfp(), Effects(dimension="planar"))
    copy = again(model)
    assert copy.spec == model.spec
    program = "import pickle, sys; print(pickle.load(sys.stdin.buffer).spec.key)"
    run = subprocess.run([sys.executable, "-c", program], input=pickle.dumps(model), capture_output=True, check=True)
    assert run.stdout.decode().strip() == model.spec.key


def test_every_preset_scene_round_trips_to_toml():
    for name in presets.names("scene"):
        scene = presets.scene(name)
        assert scene_from_table(tomllib.loads(scene_text(scene))) == scene, name


def test_every_example_round_trips_to_toml():
    for path in sorted(EXAMPLES.glob("*.toml")):
        scene = load_scene(path)
        assert scene_from_table(tomllib.loads(scene_text(scene))) == scene and again(scene) == scene


def test_dataset_is_drawn_by_xarray():
    """Labels come from the attributes: a person sees names and units without writing any."""
    data = preset_run(NAME).dataset
    figure, (left, right) = plt.subplots(1, 2)
    data["sliding"].plot.line(x="time", ax=left)
    assert len(left.lines) == data.sizes["surface"] and "[m]" in left.get_ylabel() and "[s]" in left.get_xlabel()
    np.testing.assert_array_equal(left.lines[0].get_ydata(), data["sliding"].isel(surface=0))
    data["top_force"].sel(axis="E1").plot(ax=right)
    assert "[N]" in right.get_ylabel() and "E1" in right.get_title()
    data["normal_force"].isel(time=slice(0, 20)).plot.pcolormesh(ax=left)
    plt.close(figure)


def test_import_is_fast():
    """Beside a bare Python, the best of five, so that a busy machine does not fail it."""

    def best(code):
        seconds = []
        for _ in range(5):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            seconds.append(time.perf_counter() - begin)
        return min(seconds)

    assert best("import msfp_gen") - best("pass") < 0.3
