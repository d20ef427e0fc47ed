"""Fits: known coefficients from synthetic tests, what cannot be identified, tests in files, and the command."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plain import plain_scene
from scipy.stats import t
from support import Array, scene_of

from msfp_gen import InputError, Measurement, Motion, RunError, Scene, fit, load_scene, simulate
from msfp_gen.cli import main
from msfp_gen.scene.file.loader import scene_text
from msfp_gen.studies.calibration import fitting, read_measurement
from msfp_gen.studies.calibration.fitting import search_range, start_fit
from msfp_gen.studies.calibration.intervals import Noise, identified, spread_of

ROWS = 200
NOISE = 0.005  # of the largest force
FRICTION = ("friction[0]", "friction[1]=friction[2]", "friction[3]")
PATHS = ("bearing.surfaces[0].friction", "bearing.surfaces[1].friction=bearing.surfaces[2].friction",
         "bearing.surfaces[3].friction")  # fmt: skip
TRUE = (0.03, 0.017, 0.107)
HEADER = "time [s],displacement [mm],force [kN]"


@cache
def rig() -> Scene:
    """The triple pendulum of PEER 2017/07 on its rig, with damped contacts."""
    scene = scene_of("fenz-test2")
    return replace(scene, bearing=scene.bearing.replace(contact_damping=1e-4))


@cache
def start() -> Scene:
    """The same with other coefficients."""
    return replace(rig(), bearing=rig().bearing.replace(friction=[0.039, 0.0136, 0.0136, 0.128]))


@cache
def near() -> Scene:
    """The same with the coefficient of surface 4 as it was in the tests."""
    return replace(rig(), bearing=rig().bearing.replace(friction=[0.039, 0.0136, 0.0136, 0.107]))


@cache
def loop(amplitude: float, axial_load: float | None = None) -> tuple[Array, Array, Array]:
    """Time, displacement and force of one cycle, from a run at a tight tolerance."""
    motion = Motion.harmonic(amplitude, 0.1, cycles=1.0)
    top = rig().top if axial_load is None else replace(rig().top, axial_load=axial_load)  # type: ignore[call-arg]
    step = motion.duration / (ROWS - 1)
    solver = replace(rig().solver, rtol=1e-7)
    scene = replace(rig(), motion=motion, motion_table=None, duration=None, output_step=step, top=top, solver=solver)
    time, run = np.linspace(0, motion.duration, ROWS), simulate(scene).history
    return time, motion.evaluate(time)[:, 0], np.interp(time, run.time, run.top_force[:, 0])


def measured(amplitude: float, seed: int = 0, offset: float = 0.0, axial_load: float | None = None) -> Measurement:
    """A synthetic test with noise."""
    time, displacement, force = loop(amplitude, axial_load)
    noise = NOISE * np.abs(force).max() * np.random.default_rng(seed).standard_normal(ROWS)
    return Measurement(f"test {amplitude:g}", time, displacement, force + noise + offset, axial_load)


def written(folder: Path, test: Measurement, name: str = "test.csv") -> Path:
    """A test as a file in mm and kN."""
    rows = np.column_stack([test.time, 1e3 * test.displacement, 1e-3 * test.force]).tolist()
    path = folder / name
    path.write_text("\n".join([HEADER, *(",".join(map(repr, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


@pytest.mark.slow
def test_known_friction_is_recovered_from_two_amplitudes_with_noise_and_offset() -> None:
    tests = [measured(0.03, 1, offset=150.0), measured(0.12, 2, offset=-100.0)]
    found = fit(start(), tests, FRICTION, offset=True)
    for path, true in zip(PATHS, TRUE, strict=True):
        estimate = found[path]
        assert abs(estimate.value - true) < 4 * estimate.deviation < 0.1 * true
        assert estimate.low < estimate.value < estimate.high
        assert estimate.high - estimate.value - estimate.run_error == pytest.approx(1.97 * estimate.deviation, rel=0.02)
    for test, true in zip(tests, (150.0, -100.0), strict=True):
        estimate = found[f"offset of {test.name}"]
        assert abs(estimate.value - true) < 4 * estimate.deviation < 40
    for fitted in found.tests:
        assert fitted.share == pytest.approx(NOISE, rel=0.3)
    assert not found.unidentified and not found.notes
    assert len(repr(found).splitlines()) <= 10
    assert np.diag(found.correlation) == pytest.approx(np.ones(5))


@pytest.mark.slow
def test_a_fit_to_tests_with_two_axial_loads_and_weights() -> None:
    tests = [measured(0.05, 1), replace(measured(0.05, 2, axial_load=2e5), weight=3.0)]
    result = fit(near(), tests, FRICTION[:2])
    assert result[PATHS[0]].value == pytest.approx(TRUE[0], rel=0.02)


def test_a_test_with_another_axial_load() -> None:
    tests = [measured(0.05, 1), measured(0.05, 2, axial_load=2e5)]
    assert [s.top.axial_load for s in start_fit(start(), tests, FRICTION).scenes] == [112e3, 2e5]
    with pytest.raises(InputError, match=r"axial_load.*its own load"):
        fit(start(), tests, ["top.axial_load"])


def test_a_small_amplitude_does_not_see_the_last_surface() -> None:
    """Surface 4 does not slide in the test, and the inner surfaces act as one: all are named."""
    found = fit(start(), [measured(0.02)], ["friction[*]"])
    text = "\n".join(found.unidentified)
    assert "surfaces[3].friction" in text + "\n".join(found.notes)
    assert "surfaces[1].friction" in text and "surfaces[2].friction" in text
    assert len(repr(found).splitlines()) <= 10


def test_friction_and_lever_arm_from_one_amplitude_are_named() -> None:
    """Both radii of a pair act together with the heights between them."""
    paths = ["friction[0]", "surfaces[0].radius", "bodies[0].height"]
    found = fit(rig(), [measured(0.05)], [f"bearing.{path}" for path in paths])
    assert any("radius" in line and "height" in line for line in found.unidentified), found.unidentified


def test_covariance_and_names_of_a_linear_fit() -> None:
    x = np.linspace(-1, 1, 50)
    jacobian = np.column_stack([x, x**2, 2 * x, np.zeros(50)])
    white = [Noise(0.04, np.eye(1, 50)[0], 46.0)]
    known = identified(jacobian, "abcd")
    assert known.lines[0] == "not seen by the tests: d"
    assert known.lines[1].startswith("cannot be told apart by these tests: a, c;")
    assert np.isinf(known.condition)
    found = spread_of(known, white)
    assert found.deviation[1] == pytest.approx(0.2 / np.sqrt((x**4).sum()))
    assert found.half[1] == pytest.approx(t.ppf(0.975, 46) * found.deviation[1])
    assert np.isinf(found.half[[0, 2, 3]]).all() and np.isinf(found.deviation[[0, 2, 3]]).all()
    assert found.correlation[1, 1] == pytest.approx(1.0) and np.isnan(found.correlation[0]).all()
    whole = spread_of(identified(jacobian[:, :2], "ab"), white)
    assert whole.deviation**2 == pytest.approx(0.04 * np.diag(np.linalg.inv(jacobian[:, :2].T @ jacobian[:, :2])))


def test_the_jacobian_is_that_of_the_residuals() -> None:
    scene = replace(rig(), solver=replace(rig().solver, rtol=1e-8))
    residuals = start_fit(scene, [measured(0.05)], FRICTION, offset=True)
    x = np.array([1.0, 1.0, 1.0, 0.01])
    exact = residuals.at(x).jacobian
    for column, step in enumerate(1e-3 * np.eye(4)):
        difference = (residuals.at(x + step).residuals - residuals.at(x - step).residuals) / 2e-3
        assert np.linalg.norm(difference - exact[:, column]) < 0.03 * max(np.linalg.norm(exact[:, column]), 1e-2)


def test_long_records_are_averaged_in_blocks() -> None:
    time = np.linspace(0, 10, 5001)
    test = Measurement("long", time, np.sin(time), np.sin(time + 0.2)).sampled()
    assert len(test.time) <= 2000
    assert test.time[0] == 0 and test.time[1] == pytest.approx(time[1:4].mean())
    assert test.displacement[5] == pytest.approx(np.sin(test.time[5]), abs=1e-5)


def test_files_with_other_columns_and_units(tmp_path: Path) -> None:
    test = measured(0.05)
    path = tmp_path / "lab.txt"
    rows = zip(test.time, test.force / 1e3, test.displacement, strict=True)
    text = "\n".join(f"{t!r};{f!r};{u!r}" for t, f, u in ((float(a), float(b), float(c)) for a, b, c in rows))
    path.write_text("# rig 3\nTime (s);Load cell;Stroke [m]\n" + text, encoding="utf-8")
    read = read_measurement(path, {"force": "Load cell [kN]", "displacement": "stroke"})
    assert read.force == pytest.approx(test.force) and read.displacement == pytest.approx(test.displacement)
    with pytest.raises(InputError, match=r"^lab.txt, line 2: column 'Load cell' has no unit"):
        read_measurement(path, {"force": "Load cell", "displacement": "stroke"})
    with pytest.raises(InputError, match=r"^lab.txt, line 2: no column 'force' among 'Time \(s\)'"):
        read_measurement(path, {"displacement": "stroke"})


@pytest.mark.parametrize(
    ("row", "text", "message"),
    [
        (4, "0.2,x,1", "line 5: column 'displacement [mm]': 'x' is not a finite number"),
        (4, "0.2,1,nan", "line 5: column 'force [kN]': 'nan' is not a finite number"),
        (4, "0.2,1", "line 5: 2 columns, the header names 3"),
        (4, "0,1,1", "line 5: column 'time [s]': 0 does not increase"),
        (0, "time [s],displacement [mm],force [mm]", "line 1: column 'force [mm]': the unit 'mm' is not a unit of [N]"),
    ],
)
def test_bad_rows_are_named(tmp_path: Path, row: int, text: str, message: str) -> None:
    path = written(tmp_path, measured(0.05))
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[row] = text
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_measurement(path)
    assert str(caught.value).startswith(f"test.csv, {message}")


def test_a_file_that_ends_inside_its_last_number_is_refused(tmp_path: Path) -> None:
    """Decimals of fixed count: the last number has fewer."""
    path = tmp_path / "test.csv"
    rows = [",".join((f"{t:.3f}", f"{1e3 * u:.3f}", f"{1e-3 * f:.4f}")) for t, u, f in zip(*loop(0.05), strict=True)]
    path.write_text("\n".join([HEADER, *rows]), encoding="utf-8")
    assert len(read_measurement(path).time) == ROWS
    path.write_text("\n".join([HEADER, *rows])[:-2], encoding="utf-8")
    with pytest.raises(InputError, match=rf"test\.csv, line {ROWS + 1}: the file ends inside the number .*4 decimals"):
        read_measurement(path)


@pytest.mark.parametrize("end", ["", "\n"])
def test_a_header_alone_is_refused(tmp_path: Path, end: str) -> None:
    path = tmp_path / "test.csv"
    path.write_text(HEADER + end, encoding="utf-8")
    with pytest.raises(InputError, match=r"test\.csv, line 1: no rows of numbers after the header"):
        read_measurement(path)


def test_tests_that_cannot_be_fitted_are_refused() -> None:
    test = measured(0.05)
    for changes, message in (
        ({"force": -test.force}, "opposite signs"),
        ({"displacement": test.displacement + 0.02}, "row 1: displacement = 0.02 m; a run starts at the centre"),
        ({"time": test.time[::-1]}, "row 2: time = .* does not increase"),
        ({"force": 0 * test.force}, "force is constant"),
        ({"weight": 0.0}, "weight = 0.0: give a positive number"),
    ):
        with pytest.raises(InputError, match=message):
            replace(test, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("paths", "bounds", "message"),
    [
        (["motion.scale"], {}, "the tests give the motion"),
        (["friction[9]"], {}, "there are 4 of them"),
        (["friction[0]", "friction[0]=friction[1]"], {}, "given twice"),
        (["friction[0]=radius[0]"], {}, "different quantities"),
        (["friction[0]"], {"friction[1]": (0.0, 1.0)}, "no parameter of this fit"),
        (["friction[0]"], {"friction[0]": (-1.0, 1.0)}, "this field is at least 0"),
        (["friction[0]"], {"friction[0]": (0.1, 0.2)}, "the scene has 0.039"),
        (["friction[0]"], {"friction[0]": (0.2, 0.1)}, "a lower bound below an upper one"),
        ([], {}, "give a list of paths"),
    ],
)
def test_wrong_parameters_and_bounds_are_named(paths: list[str], bounds: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit(start(), [measured(0.05)], paths, bounds=bounds)


def test_scenes_that_are_no_test_are_refused() -> None:
    with pytest.raises(InputError, match="no contact damping"):
        fit(load_scene("fenz-test2"), [measured(0.05)], ["friction[0]"])
    with pytest.raises(InputError, match=r'top\.kind = "mass"'):
        fit(plain_scene("ridgecrest-clc"), [measured(0.05)], ["friction[0]"])
    with pytest.raises(InputError, match=r"tests = .*give a list"):
        fit(start(), [], ["friction[0]"])


def test_tests_of_another_size_than_the_bearing_are_refused() -> None:
    """A wrong unit is named before a run."""
    test = measured(0.05)
    for changes, message in (
        (
            {"displacement": 1e3 * test.displacement},
            "test 0.05: displacement reaches 50 m, .* slide by 0.173 m at most",
        ),
        ({"force": 1e3 * test.force}, r"force reaches 1.* of the axial load; check the unit"),
        ({"force": 1e-3 * test.force}, r"force reaches 0\.000.* of the axial load"),
    ):
        with pytest.raises(InputError, match=message):
            fit(start(), [replace(test, **changes)], ["friction[0]"])  # type: ignore[arg-type]


def test_tests_of_one_name_are_told_apart() -> None:
    tests = [measured(0.05), measured(0.05), replace(measured(0.12), name="other")]
    assert [test.name for test in start_fit(start(), tests, FRICTION).tests] == ["test 0.05", "test 0.05 (2)", "other"]


def test_the_command_writes_a_scene_that_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, test = tmp_path / "scene.toml", written(tmp_path, measured(0.05))
    scene.write_text(scene_text(near()), encoding="utf-8")
    out = tmp_path / "out"
    command = ["fit", str(scene), str(test), "-p", "friction[0],friction[1]=friction[2]"]
    command += ["--bounds", "friction[0]=0.01:0.09", "--axial-load", "112e3", "--weights", "2", "--offset"]
    page = tmp_path / "fit.html"
    assert main([*command, "--json", "-o", str(out), "--report", str(page), "--sign", "top-base"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["estimates"][0]["value"] == pytest.approx(TRUE[0], rel=0.02)
    assert {path.name for path in out.iterdir()} == {"scene.toml", "fit.json", "residuals.csv", "fit.png"}
    fitted = load_scene(out / "scene.toml")
    assert fitted.bearing.surfaces[0].friction == found["estimates"][0]["value"]
    assert fitted.motion == near().motion
    assert f"{found['estimates'][0]['value']:.5g}" in page.read_text(encoding="utf-8")
    assert (
        found["estimates"][0]["bounds"] == pytest.approx([0.01, 0.09])
        and found["estimates"][-1]["bounds"] == [None] * 2
    )
    rows = np.genfromtxt(out / "residuals.csv", delimiter=",", skip_header=1)[:, 2:4]
    assert rows == pytest.approx(-np.column_stack([measured(0.05).displacement, measured(0.05).force]), rel=1e-12)
    assert "top less base" in page.read_text(encoding="utf-8")
    assert len((out / "residuals.csv").read_text().splitlines()) == ROWS + 1
    assert tomllib.loads((out / "scene.toml").read_text())["bearing"]["surfaces"][1]["friction"] != 0.0136
    assert main(command) == 0
    assert "95 % interval" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--axial-load", "1e5,2e5"], "--axial-load = '1e5,2e5': give 1 numbers"),
        (["--bounds", "friction[0]"], "--bounds = 'friction[0]'"),
        (["--column", "force"], "--column = 'force'"),
        (["--column", "load=x"], "columns: 'load' is no column"),
        (["--report", "fit.pdf"], "--report = 'fit.pdf'"),
    ],
)
def test_wrong_options_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str
) -> None:
    test = written(tmp_path, measured(0.05))
    out = tmp_path / "out"
    assert main(["fit", "fenz-test2", str(test), "-p", "friction[0]", "-o", str(out), *options]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_a_model_that_misses_part_of_the_test_gets_a_note() -> None:
    found = fit(start(), [measured(0.05)], FRICTION[:2])
    assert any("residuals are correlated" in note for note in found.notes)


def test_a_value_at_its_bound_gets_a_note() -> None:
    found = fit(start(), [measured(0.12)], FRICTION[:1], bounds={"friction[0]": (0.035, 0.05)})
    assert found[PATHS[0]].at_bound and found[PATHS[0]].value == pytest.approx(0.035, rel=1e-2)
    assert any("at its bound" in note for note in found.notes)
    assert found[PATHS[0]].value - 0.035 < 0.1 * found[PATHS[0]].deviation


def test_the_search_ends_where_a_step_is_within_the_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise of 0.5 %: the rest of the search changes every value by less than its error.

    Exact tests: the errors of the runs decide. The fit says so, and its intervals contain the true values.
    """
    short, whole = (start_fit(start(), [measured(0.12, seed=1)], FRICTION) for _ in range(2))
    x, end = fitting.least_squares(short, *search_range(short), 100)
    with monkeypatch.context() as patched:
        patched.setattr(fitting, "WITHIN", 0.0)
        other, _ = fitting.least_squares(whole, *search_range(whole), 100)
    assert short.count < whole.count
    assert end.step_in_errors(x - other) < 1
    exact = fit(start(), [Measurement("exact", *loop(0.05))], FRICTION)
    assert any("errors of the runs limit" in note for note in exact.notes), exact.notes
    assert exact.rtol == pytest.approx(1e-7)
    for path, true in zip(PATHS, TRUE, strict=True):
        assert exact[path].low <= true <= exact[path].high
        assert exact[path].value == pytest.approx(true, rel=2e-3)


def test_intervals_are_infinite_where_the_error_of_the_runs_cannot_be_measured() -> None:
    """Runs at the tolerance of the scene need fewer steps than the limit, tighter ones more."""
    scene = replace(near(), solver=replace(near().solver, max_steps=600))
    found = fit(scene, [measured(0.05)], FRICTION[:1])
    assert found.rtol == 1e-4 and np.isinf(found[PATHS[0]].high) and np.isinf(found[PATHS[0]].run_error)
    assert found.as_dict()["estimates"][0]["run_error"] is None
    assert any("could not be measured" in note and "rtol = 1e-06 fail" in note for note in found.notes), found.notes
    assert "not determined" in repr(found)


def test_runs_are_tighter_in_both_tolerances() -> None:
    scene = replace(near(), solver=replace(near().solver, rtol=1e-5, atol_angle=1e-6))
    residuals = start_fit(scene, [measured(0.05)], FRICTION)
    residuals.tighten(100.0)
    assert residuals.rtol == pytest.approx(1e-7)
    assert residuals.scenes[0].solver.angle_tolerance == pytest.approx(1e-8)


def test_a_fit_that_does_not_converge_says_so() -> None:
    with pytest.raises(RunError, match="not converged after 2 evaluations"):
        fit(start(), [measured(0.12)], FRICTION, max_evaluations=2)


def test_progress_counts_evaluations() -> None:
    seen: list[tuple[int, float, float]] = []
    found = fit(start(), [measured(0.12)], FRICTION[:1], progress=lambda *given: seen.append(given))
    assert {count for count, _, _ in seen} == set(range(1, found.evaluations + 1))
    assert all(0 <= share <= 1 for _, share, _ in seen)
    assert seen[-1][2] > 0
