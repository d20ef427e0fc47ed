"""What `msfp-gen generate -o` leaves behind serves without this package: a plain script, and a program in C."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, Array

from msfp_gen import Effects, Layout, Motion, Scene, Solver, Top, build_model, cli, presets, simulate
from msfp_gen.embedding.library import README
from msfp_gen.jit.compiler import FLAGS, find_compiler, x86_64_level
from msfp_gen.motions.piecewise import hermite5
from msfp_gen.specification import contract

LOAD = 112e3
REPORT = Effects(bouc_wen="report")  # that of main.c
MAIN = ROOT / "tests" / "support" / "c" / "main.c"

STATE = {  # the same as in main.c
    "q": [[0.01 * k, -0.02 * k, 0.0] for k in range(1, 5)],
    "v": [[0.0, 0.1, 0.0]] * 4,
    "h": [[0.3, -0.2]] * 4,
}

# Only numpy and the generated module; `-I` keeps this checkout and the user's own packages off the path.
SCRIPT = """
import json, sys
sys.path[:0] = [{folder!r}, {packages!r}]
import numpy as np
import msfp_5_2_2 as model
given = json.load(sys.stdin)
bodies, surfaces, top = (np.array(given[name]) for name in ("bodies", "surfaces", "top"))
stack = model.Stack(9.8, bodies, surfaces, top)
base, load = np.zeros((3, 6)), np.array([0.0, 0.0, -112e3, 0.0, 0.0, 0.0])
base[2, 0] = 0.5
status, a, row, rates, *_ = stack.accelerations(*(np.array(given[name]) for name in "qvh"), base, load)
foreign = sorted(name for name in sys.modules if name.partition(".")[0] in ("msfp_gen", "sympy", "scipy", "Cython"))
print(json.dumps(dict(status=status, acceleration=a.tolist(), friction_rate=rates.tolist(), layout=model.LAYOUT,
                      file=model.__file__, foreign=foreign)))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("plain") / "model"
    try:
        code = cli.main(["generate", "5", "2", "2", "--bouc-wen", "report", "-o", str(target)])
    except SystemExit as end:
        code = end.code
    assert not code
    return target


def values() -> dict[str, list[list[float]]]:
    """The bearing and its top as the generated module takes them, written out from the public objects."""
    bearing = presets.bearing("fenz-tfp").replace(contact_damping=0.0)
    base = [bearing.base_height, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    bodies = [[b.height, b.centroid, b.mass, *b.inertia, b.rim_radius, b.rim_offset] for b in bearing.bodies]
    surfaces = [
        [s.radius, s.capacity, s.friction, s.yield_displacement, s.rim_stiffness, s.rim_damping, s.contact_damping]
        for s in bearing.surfaces
    ]
    return {"bodies": [base, *bodies], "surfaces": surfaces, "top": [0.0] * len(contract.TOP)}  # type: ignore[list-item]


def test_plain_script_imports_nothing_but_the_folder(folder: Path, tmp_path: Path) -> None:
    code = SCRIPT.format(folder=str(folder), packages=sysconfig.get_path("purelib"))
    given = json.dumps(values() | STATE)
    command = [sys.executable, "-I", "-S", "-c", code]
    done = subprocess.run(command, input=given, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["status"] == "ok" and found["layout"] == [5, 2, 2] and found["foreign"] == []
    assert Path(found["file"]).parent == folder
    applied = {"base_acceleration": (0.5, 0.0, 0.0), "top_force": (0.0, 0.0, -LOAD)}
    expected = build_model(Layout.tfp(), REPORT).evaluate(
        presets.bearing("fenz-tfp").replace(contact_damping=0.0), **STATE, **applied
    )  # type: ignore[arg-type]
    assert expected.acceleration is not None
    assert np.array(found["acceleration"]) == pytest.approx(expected.acceleration, rel=1e-9, abs=1e-6)
    assert np.array(found["friction_rate"]) == pytest.approx(expected.friction_rate, rel=1e-9)


def test_folder_holds_sources_with_their_log_and_no_part_files(folder: Path) -> None:
    names = {path.name for path in folder.rglob("*")}
    assert {
        "msfp_model.h",
        "msfp_kernels.h",
        "msfp_runtime.h",
        "msfp_module.pyx",
        "build.log",
        "manifest.json",
    } <= names
    assert not [name for name in names if name.startswith(".") or name.endswith(".o")]


def test_readme_names_every_file_value_and_status(folder: Path) -> None:
    text = (folder / README).read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w.]+)`", text))
    files = {path.name for path in folder.rglob("*") if path.is_file()} - {README}
    assert {name for name in files if not name.endswith((".so", ".pyd"))} <= named
    assert {name for name in named if name.endswith((".c", ".h", ".pyx"))} <= files
    for entries in (contract.BODY, contract.SURFACE, contract.TOP, contract.row(REPORT), contract.EVENT_KINDS):
        for entry in entries:
            assert entry.meaning in text, entry.name
    assert {status.name for status in contract.STATUSES if status.compiled} <= named


def test_example_of_the_readme_runs(folder: Path) -> None:
    code = re.search(r"^```python\n(.*?)^```", (folder / README).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert code
    done = subprocess.run([sys.executable, "-c", code[1]], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ok") and float(done.stdout.split()[-1]) < 1e-6


@pytest.mark.slow  # models of their own
@pytest.mark.parametrize(
    "options", [["--sliders", "massless", "--dimension", "planar"], ["--uplift"], ["--top-rotation"]], ids="-".join
)
def test_example_of_other_models_runs(options: list[str], tmp_path: Path) -> None:
    assert not cli.main(["generate", "2", "1", "0", *options, "-o", str(tmp_path)])
    text = (tmp_path / README).read_text(encoding="utf-8")
    code = re.search(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert code
    done = subprocess.run([sys.executable, "-c", code[1]], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("ok") and "nan" not in done.stdout


def test_derived_and_shared_sources_lie_apart(folder: Path) -> None:
    """What is in `runtime` is the same for every model, what is in `derived` names this one."""
    shared = {path.name: path.read_text(encoding="utf-8") for path in (folder / "runtime").glob("*.[ch]")}
    derived = {path.name: path.read_text(encoding="utf-8") for path in (folder / "derived").iterdir()}
    assert {"msfp_kernels.h", "msfp_schedule.h", "msfp_model.h"} <= set(derived)
    assert {"run.c", "contact.c", "msfp.h"} <= set(shared)
    assert not [name for name, text in shared.items() if "for 5_2_2" in text or "MSFP_N 5" in text]
    assert {path.suffix for path in folder.iterdir() if path.is_file()} <= {".so", ".pyd", ".json", ".log", ".md"}


def run_program(folder: Path, place: Path, *flags: str) -> str:
    """Compile the C program with the sources of a folder, and return what it prints."""
    place.mkdir()
    for path in (MAIN, *folder.rglob("*.[ch]")):
        if path.name not in ("msfp_entry.c", "example.c"):  # the entry is of the wrapper, the example has its own main
            shutil.copy(path, place)
    units = sorted(path.name for path in place.glob("*.c"))
    command = [*find_compiler().command, *FLAGS["c"], *flags, "-Werror", *units, "-o", "program", *FLAGS["libraries"]]
    built = subprocess.run(command, cwd=place, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([place / "program"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-500:]
    return done.stdout


@pytest.fixture(scope="module")
def printed(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Array]:
    """What the C program prints: one array of rows a name; the text of its status apart."""
    output = run_program(folder, tmp_path_factory.mktemp("programs") / "all", "-O0")
    rows: dict[str, list[list[float]]] = {}
    *lines, last = output.splitlines()
    assert last == "status ok", output[-500:]
    for line in lines:
        name, *numbers = line.split()
        rows.setdefault(name, []).append([float(x) for x in numbers])
    return {name: np.array(row) for name, row in rows.items()}


def test_no_c_file_needs_python(folder: Path) -> None:
    assert not [path.name for path in folder.rglob("*.[ch]") if "Python.h" in path.read_text(encoding="utf-8")]


def test_program_evaluates_as_python_does(printed: dict[str, Array]) -> None:
    """main.c has its rig's springs, which pull a tilted stack back, so the same Top goes in here."""
    model, bearing = build_model(Layout.tfp(), REPORT), presets.bearing("fenz-tfp").replace(contact_damping=0.0)
    stack = model.stack(bearing, Top.rig(LOAD, 1e8, 5.0, 1e6, 5.0))
    base = np.zeros((3, 6))
    base[2, 0] = 0.5
    load = np.array([0.0, 0.0, -LOAD, 0.0, 0.0, 0.0])
    status, a, row, rates, *_ = stack.accelerations(*(np.array(STATE[name]) for name in "qvh"), base, load)
    assert status == "ok"
    assert printed["acceleration"][0] == pytest.approx(a.ravel(), rel=1e-9, abs=1e-6)
    assert printed["normal_force"][0] == pytest.approx(model.unpack(row)["normal"], rel=1e-12)
    assert printed["friction_rate"][0] == pytest.approx(rates.ravel(), rel=1e-12)


def test_program_runs_as_python_does(printed: dict[str, Array]) -> None:
    period, amplitude = 2.0, 0.01
    knots = np.arange(65) * (period / 64)
    w = 2 * np.pi / period
    rows = np.zeros((3, 65, 6))
    rows[:, :, 0] = amplitude * np.array([1 - np.cos(w * knots), w * np.sin(w * knots), w**2 * np.cos(w * knots)])
    motion = Motion(knots=knots, coefficients=hermite5(knots, *rows))
    scene = Scene(
        presets.bearing("fenz-tfp").replace(contact_damping=0.0),
        motion,
        Top.rig(LOAD, 1e8, 5.0, 1e6, 5.0),
        solver=Solver(rtol=1e-5),
        effects=REPORT,
        output_step=0.02,
    )
    run = simulate(scene)
    assert printed["time"][:, 0] == pytest.approx(run.history.time, abs=1e-12) and len(printed["time"]) == 101
    assert printed["steps"][0, 0] == run.counters.steps
    peak = np.abs(run.history.top_force[:, 0]).max()
    # The program makes its motion itself, with its own rounding; that may move where Newton's method stops, and with it
    # the answer, but within the tolerance of the run.
    assert np.abs(printed["top_force"] - run.history.top_force).max() < scene.solver.rtol * peak
    assert peak > 0.05 * LOAD


@pytest.mark.slow
def test_programs_for_every_processor_give_the_same_numbers(folder: Path, tmp_path: Path) -> None:
    """A model in the cache is compiled for one level of x86-64, so results do not depend on the machine."""
    level = x86_64_level()
    if level is None:
        pytest.skip("no x86-64 processor")
    printed = {run_program(folder, tmp_path / "all")}
    for lower in range(1, level + 1):
        printed.add(run_program(folder, tmp_path / str(lower), f"-DMSFP_X86_64_LEVEL={lower}"))
    assert len(printed) == 1 and printed.pop().count("top_force") == 101
