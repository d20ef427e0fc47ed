"""The command line: what is printed where, which files appear, and exit codes."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys
import time

import pytest
from support.synthetic import loops, ramp

from msfp_gen.cli import main
from msfp_gen.cli.console import ShownProgress
from msfp_gen.cli.run_commands import DEMO
from msfp_gen.common.errors import CompileError, RunError
from msfp_gen.common.tables import Table
from msfp_gen.jit.build import BuildInfo
from msfp_gen.results.result import load_result


@pytest.fixture
def simulated(monkeypatch):
    """Replace building and integrating: scenes that were asked for are kept, and made-up loops come back."""
    asked = []

    def simulate(scene, *, progress=None, strict=False):
        asked.append(scene)
        return dataclasses.replace(loops(), scene=scene)

    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", simulate)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)
    return asked


@pytest.fixture
def failing(simulated, monkeypatch):
    """The run stops half-way with what was computed until then."""

    def simulate(scene, *, progress=None, strict=False):
        partial = dataclasses.replace(loops(), scene=scene, status="newton_failed", message="t = 3 s, surface 2")
        raise RunError(
            "t = 3 s, surface 2:\nNewton did not converge; give a smaller max_step",
            status="newton_failed",
            result=partial,
        )

    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", simulate)


def assert_one_line_error(capsys, *words):
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: ") and err.count("\n") == 1 and err.endswith("\n")
    for word in words:
        assert word in err


@pytest.mark.parametrize("arguments", [[], ["--help"], ["run", "--help"], ["generate", "--help"]])
def test_help_has_examples(arguments, capsys):
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert "Usage: msfp-gen" in out and "Example" in out and "\n    msfp-gen " in out


def test_version(capsys):
    from msfp_gen.common.version import __version__

    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"msfp-gen {__version__}\n"


def test_help_loads_nothing_heavy():
    code = (
        "import sys\nfrom msfp_gen.cli import main\nassert main(['--help']) == 0\n"
        "print([name for name in ('numpy', 'sympy', 'scipy', 'xarray', 'pint', 'matplotlib', 'rich')"
        " if name in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1] == "[]"


def test_module_runs_as_a_program():
    done = subprocess.run([sys.executable, "-m", "msfp_gen", "frobnicate"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: No such command 'frobnicate'")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run"], ["SCENE"]),
        (["frobnicate"], ["frobnicate", "--help"]),
        (["run", "fenz-test2", "--frob"], ["--frob"]),
        (["run", "fenz-test2", "--rtol", "small"], ["--rtol", "small"]),
        (["run", "fenz-test2", "--rtol", "-1"], ["solver.rtol", "-1"]),
        (["run", "fenz-test2", "--method", "euler"], ["solver.method", "euler", "dopri5"]),
        (["run", "fenz-test2", "--duration", "1e9"], ["duration", "56.25"]),
        (["run", "fenz-tset2"], ["fenz-tset2", "fenz-test2"]),
        (["run", "nowhere.toml"], ["nowhere.toml"]),
        (["explain", "nowhere.toml"], ["nowhere.toml"]),
        (["generate", "5", "2", "1"], ["layout.n = 5", "n = m + p + 1"]),
        (["generate", "5", "2", "two"], ["two"]),
        (["generate", "5", "2", "2", "--spin", "loose"], ["effects.spin", "loose", "locked"]),
        (["generate", "5", "2", "2", "--sliders", "massless", "--spin", "free"], ["effects.spin", "massless"]),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, words, capsys, simulated):
    assert main(arguments) == 2
    assert_one_line_error(capsys, *words)
    assert simulated == []


@pytest.mark.parametrize(
    ("option", "path", "words"),
    [
        ("-o", "run.txt", ["--output", "run.txt", ".nc"]),
        ("-o", "nowhere/run.nc", ["--output", "nowhere", "does not exist"]),
        ("--plot", "run.gif", ["--plot", "run.gif", ".png"]),
        ("--plot", "nowhere/run.png", ["--plot", "nowhere", "does not exist"]),
    ],
)
def test_outputs_are_judged_before_the_run(option, path, words, capsys, simulated, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "fenz-test2", option, path]) == 2
    assert_one_line_error(capsys, *words)
    assert simulated == [] and not list(tmp_path.iterdir())


def test_run_prints_tables_and_writes_what_was_asked_for(capsys, simulated, tmp_path):
    data, picture = tmp_path / "run.nc", tmp_path / "run.png"
    assert main(["run", "fenz-test5", "-o", str(data), "--plot", str(picture)]) == 0
    out, err = capsys.readouterr()
    assert "fenz-test5" in out and "E1 140" in out and "1250 times real time" in out
    surface = next(line.split() for line in out.splitlines() if line.split()[:1] == ["4"])
    assert surface == ["4", "65.10", "65.00", "-0.10", "yes", "112.000", "112.000"]
    assert err == f"wrote {data}\nwrote {picture}\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.nc", "run.png"]
    assert load_result(data).scene == simulated[0]


def test_run_prints_the_summary_as_json_and_nothing_else(capsys, simulated):
    assert main(["run", "fenz-test5", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == dataclasses.replace(loops(), scene=simulated[0]).summary
    assert err == ""


def test_options_change_the_scene(simulated):
    options = ["--method", "dopri5", "--rtol", "1e-6", "--max-step", "0.01", "--duration", "7"]
    assert main(["run", "fenz-test2", "--json", *options]) == 0
    (scene,) = simulated
    assert (scene.solver.method, scene.solver.rtol, scene.solver.max_step, scene.end) == ("dopri5", 1e-6, 0.01, 7.0)


def test_options_not_given_leave_the_scene(simulated):
    from msfp_gen.scene.file.source import load_scene

    assert main(["run", "fenz-test2", "--json"]) == 0
    assert simulated == [load_scene("fenz-test2")]


def test_scene_files_are_read(simulated, tmp_path):
    from msfp_gen.scene.file.loader import scene_text
    from msfp_gen.scene.file.source import load_scene

    path = tmp_path / "scene.toml"
    path.write_text(scene_text(load_scene("fenz-test1")), encoding="utf-8")
    assert main(["run", str(path), "--json"]) == 0
    assert simulated == [load_scene("fenz-test1")]


def test_failed_run_keeps_what_was_computed(capsys, failing, tmp_path):
    data, picture = tmp_path / "run.nc", tmp_path / "run.png"
    assert main(["run", "fenz-test2", "-o", str(data), "--plot", str(picture)]) == 1
    out, err = capsys.readouterr()
    assert "newton_failed" in out
    assert err.startswith("error: t = 3 s, surface 2: Newton did not converge; give a smaller max_step")
    assert err.count("\n") == 1 and str(data) in err and str(picture) in err
    assert load_result(data).status == "newton_failed"


def test_failed_run_without_output_writes_nothing(capsys, failing, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "fenz-test2", "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["status"] == "newton_failed"
    assert err == "error: t = 3 s, surface 2: Newton did not converge; give a smaller max_step\n"
    assert not list(tmp_path.iterdir())


def test_monotonic_run_shows_the_stages(capsys, simulated, monkeypatch):
    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", lambda *_, **__: ramp())
    assert main(["run", "fenz-monotonic"]) == 0
    out = capsys.readouterr().out
    lines = {
        line.split()[0]: line.split()[1:]
        for line in out.split("transitions between sliding regimes")[1].splitlines()[1:]
    }
    assert lines["u*"] == ["1.98", "mm", "surface", "2", "stops", "sliding"]
    assert lines["u_dr4"] == ["134.00", "mm", "first", "contact", "with", "rim", "4"]
    assert lines["F_dr4"][0] == "0.2661"


def test_generate_says_what_was_built_and_where(capsys, monkeypatch, tmp_path):
    calls = []

    def generate_to(spec, folder, progress=None):
        calls.append((spec.key, folder))
        progress("deriving", 0.0)
        progress("compiling x (0 of 2 files)", 0.2)
        progress("compiling x (1 of 2 files)", 0.5)
        return BuildInfo(
            folder / "msfp_7_3_3.so",
            folder,
            "msfp_7_3_3",
            spec.key,
            False,
            {"derive": 1.5, "compile": 2.25},
            4.0,
            321,
            6543,
        )

    monkeypatch.setattr("msfp_gen.jit.build.generate_to", generate_to)
    arguments = ["generate", "7", "3", "3", "-o", str(tmp_path), "--no-rims", "--dimension", "planar"]
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert calls == [("7_3_3-planar-locked-inertial-norims-report-constant", tmp_path)]
    for words in (
        "derive 1.50 s",
        "compile 2.25 s",
        "321 statements",
        "6543 operations",
        str(tmp_path),
        "msfp_7_3_3.so",
    ):
        assert words in out
    said = err.splitlines()  # a line as each stage begins, and one at the end
    assert said[:2] == ["deriving", "compiling x (0 of 2 files)"]
    assert re.fullmatch(r"built in \d\.\d s; .* cache", said[2])


def test_missing_compiler_is_bad_input(capsys, monkeypatch):
    def prepare(*_):
        raise CompileError("no C compiler found: install gcc or clang", command="cc")

    monkeypatch.setattr("msfp_gen.jit.build.prepare", prepare)
    assert main(["generate", "5", "2", "2"]) == 2
    assert_one_line_error(capsys, "no C compiler found")


def test_explain_names_every_number_and_choice(capsys):
    assert main(["explain", "fenz-test2"]) == 0
    out = capsys.readouterr().out
    for words in (
        "bearing 5_2_2",
        "473",
        "0.107",
        "25, 0, 0 mm",
        "axial load",
        "112000 N",
        "L-stable",
        "56.25 s",
        "bodies do not turn about their own axis",
    ):
        assert words in out


def test_explain_has_a_meaning_for_every_choice():
    from typing import get_args, get_type_hints

    from msfp_gen.common.fields import Choice, ruled_fields
    from msfp_gen.scene.explain import METHODS, TOPS
    from msfp_gen.scene.file.loader import _TOPS
    from msfp_gen.scene.solver import Solver
    from msfp_gen.specification.layout import Effects

    hints = get_type_hints(Effects)
    for name, rule, default in ruled_fields(Effects):
        if name != "friction_law":  # a text, shown as it is
            assert isinstance(rule, Choice) and default in rule.words and all(rule.meanings.values())
            assert set(get_args(hints[name])) in ({*rule.words}, set()), "types say what is checked"
    assert set(METHODS) == set(get_args(get_type_hints(Solver)["method"]))
    assert set(TOPS) == set(_TOPS)


def test_presets_are_listed(capsys):
    assert main(["presets"]) == 0
    out = capsys.readouterr().out
    for name in (*DEMO, "fenz-monotonic", "fenz-tfp", "becker-tfp"):
        assert f"\n  {name}" in out


def test_doctor_fails_when_something_is_missing(capsys, monkeypatch):
    from msfp_gen.jit.doctor import CheckResult

    checks = [CheckResult("python", True, "3.11"), CheckResult("C compiler", False, "none", "install gcc")]
    monkeypatch.setattr("msfp_gen.jit.doctor.diagnose", lambda: checks)
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert "MISSING" in out and "none; install gcc" in out
    checks.pop()
    assert main(["doctor"]) == 0


def test_demo_writes_figures_and_data(capsys, simulated, monkeypatch, tmp_path):
    asked = []
    drawn = "msfp_gen.studies.accuracy.study."
    monkeypatch.setattr(drawn + "work_precision", lambda scene, **options: asked.append((scene, options["tolerances"])))
    monkeypatch.setattr(drawn + "cost_table", lambda _: Table("what accuracy costs", (), [("1e-3", "0.1 %")]))
    monkeypatch.setattr(drawn + "draw_summary", lambda _, path: path.write_bytes(b"drawn"))
    folder = tmp_path / "new" / "out"
    assert main(["demo", "-o", str(folder)]) == 0
    names = sorted(path.name for path in folder.iterdir())
    assert names == sorted(["accuracy.png", *(f"{name}{suffix}" for name in DEMO for suffix in (".nc", ".png"))])
    ((scene, tolerances),) = asked
    assert scene.name == DEMO[0] and scene.solver.rtol in tolerances and len(tolerances) == 4
    out = capsys.readouterr().out
    assert "what accuracy costs" in out
    assert all(f"wrote {folder / name}" in out for name in names)
    assert [scene.name for scene in simulated] == list(DEMO)


def test_demo_refuses_a_folder_that_is_a_file(capsys, simulated, tmp_path):
    (tmp_path / "out").write_text("")
    assert main(["demo", "-o", str(tmp_path / "out")]) == 2
    assert_one_line_error(capsys, "--output")
    assert simulated == []


def test_interrupted_run_says_so(capsys, simulated, monkeypatch):
    def simulate(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("msfp_gen.simulation.simulate.simulate", simulate)
    assert main(["run", "fenz-test2"]) == 130
    assert_one_line_error(capsys, "interrupted")


def test_terminal_gets_rich_tables_and_progress(capsys, monkeypatch, simulated):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert main(["run", "fenz-test5"]) == 0
    with ShownProgress("fenz-test5") as update:
        for time in (0.0, 20.0, 20.1, 40.0):
            update(time, 40.0)
    out, err = capsys.readouterr()
    assert "─" in out and "fenz-test5" in out
    assert err.count("50 %") == 1 and "100 %" in err and err.endswith("\r\x1b[K")


def test_progress_never_falls_and_is_lines_where_there_is_no_terminal(capsys, monkeypatch):
    monkeypatch.setattr("msfp_gen.cli.console.EVERY", 0.02)
    with ShownProgress("33 runs") as update:
        time.sleep(0.06)  # nothing is known yet
        update(20, 40)
        update(10, 40)
        time.sleep(0.1)
    lines = capsys.readouterr().err.splitlines()
    assert 1 < len(lines) < 10 and set(lines) == {"33 runs: 50 %"}


def test_real_run_from_scene_to_files(capsys, tmp_path):
    """Nothing replaced: test 2 of the report, F/N = 0.083 at 25 mm."""
    data, picture = tmp_path / "run.nc", tmp_path / "run.svg"
    assert main(["run", "fenz-test2", "--json", "-o", str(data), "--plot", str(picture)]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["status"] == "ok" and summary["duration"] == 56.25
    assert summary["peak_displacement"]["radial"] == pytest.approx(0.025, rel=0.01)
    assert summary["peak_force_ratio"] == pytest.approx(0.083, abs=0.002)
    assert summary["rims_met"] == [] and summary["energy"]["closure_error"] < 2e-3
    assert load_result(data).summary == summary
    assert picture.read_text(encoding="utf-8").startswith("<?xml")


def test_real_monotonic_run_passes_all_stages(capsys):
    """Closed form: u** = 47.3 mm; Table 4.2: the others. Wide bounds: the study of the table is in the benchmarks."""
    assert main(["run", "fenz-monotonic", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["transitions"]
    assert found["u_star"] == pytest.approx(0.0019, abs=3e-4)
    assert found["u_star_star"] == pytest.approx(0.0473, abs=5e-4)
    assert found["u_dr1"] == pytest.approx(0.087, abs=1e-3) and found["F_dr1"] == pytest.approx(0.175, abs=0.003)
    assert found["u_dr4"] == pytest.approx(0.134, abs=3e-3) and found["F_dr4"] == pytest.approx(0.275, abs=0.012)
    assert found["resolution"] < 5e-4
