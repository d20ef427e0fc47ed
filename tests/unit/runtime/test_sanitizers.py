"""Generated C under AddressSanitizer, UndefinedBehaviorSanitizer and valgrind: rims, refused steps, a resumed run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import failure_of
from support.replay import REPLAY, inputs
from support.stacks import a_body, a_surface

from msfp_gen import Bearing, Effects, Layout, Motion, Scene, Solver, Top, simulate
from msfp_gen.generator import generate
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.results.result import Result

# Not optimised: nothing is removed before it is checked, and it compiles in two thirds of the time.
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-g", "-O0")
PROGRAM = "int main(void) { return 0; }\n"
Values = dict[str, Any]


def a_scene(
    layout: tuple[int, int, int], effects: Values, *, shaken: float = 0.0, sprung: bool = False, **solver: Any
) -> Scene:
    """A short hard push over the rims, and up and down where bodies may part."""
    n = layout[0]
    law = {"friction_slow": 0.02, "velocity_rate": 50.0} if effects.get("friction") == "velocity" else {}
    if effects.get("friction") == "pvt":
        law = {"reference_pressure": 3e7, "patch_radius": 0.05}
    damping = 0.0 if shaken else 1e-4  # of bodies that part: which rims they meet hangs on it
    contact = {"yield_displacement": 2e-3, "contact_damping": damping}
    surface = a_surface(0.5, capacity=0.014 if shaken else 0.02, rim_damping=50.0, rim_stiffness=1e6, **contact, **law)
    bearing = Bearing(
        layout=Layout(*layout),
        base_height=0.02,
        base_rim_radius=0.01,
        surfaces=[surface] * (n - 1),
        bodies=[a_body()] * (n - 1),
    )
    t = np.linspace(0, 0.3, 61)
    wave = np.sin(np.pi * t / 0.6) ** 3
    u = np.outer(wave * np.sin(20 * t), [(0.014 if shaken else 0.03) * n, 0.0, 0.0])
    u[:, 1] = 0.0 if effects.get("dimension") == "planar" else 0.02 * wave
    u[:, 2] = shaken * wave * np.sin(60 * t)
    held = (0.0, 0.0) if n == 2 else (1e6, 1e3)  # the plate of a single pendulum is its slider
    spring = {"vertical_stiffness": 6e6, "vertical_damping": 8e3} if sprung else {}
    top = Top.rig(1e4, 1e6, 0.0, *held) if shaken == 0.0 else Top.mass(1e3, 100.0, 0.3, *held, **spring)
    return Scene(bearing, Motion.from_arrays(t, u), top, Effects(**effects), Solver(**{"rtol": 1e-3, **solver}))


CASES: dict[str, Scene] = {
    "the report's model": a_scene((5, 2, 2), {}),
    "the report's method": a_scene((3, 1, 1), {}, method="dopri5"),
    "planar": a_scene((2, 1, 0), {"dimension": "planar"}),
    "massless": a_scene((4, 2, 1), {"sliders": "massless", "bouc_wen": "isotropic"}),
    "patch": a_scene((3, 1, 1), {"spin": "patch"}),
    "uplift": a_scene((3, 1, 1), {"uplift": True}, shaken=0.008),
    "planar uplift": a_scene((5, 2, 2), {"uplift": True, "dimension": "planar"}, shaken=0.008),
    "friction by velocity": a_scene((3, 1, 1), {"friction": "velocity"}),
    "friction by pressure, velocity and temperature": a_scene((5, 2, 2), {"friction": "pvt"}),
    "order four": a_scene((3, 1, 1), {}, method="esdirk4"),
    "a mass on a vertical spring": a_scene((3, 1, 1), {}, shaken=0.0005, sprung=True),
    "temperature, the report's method": a_scene((3, 1, 1), {"friction": "pvt"}, method="dopri5"),
}
QUICK = ("planar",)  # the others cost half a minute of compiling each
TESTED = [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in CASES]


def compiled(scene: Scene, folder: Path, flags: tuple[str, ...]) -> Path:
    """The program of one scene's model."""
    sources = runtime_sources(scene.spec) | generate(scene.spec).files
    for name, content in sources.items():
        (folder / name).write_text(content, encoding="utf-8")
    shutil.copy(REPLAY, folder)
    units = sorted(path.name for path in folder.glob("*.c"))
    name = f"-DMODEL=msfp_{scene.bearing.layout.name}"
    command = [*find_compiler().command, "-std=c99", name, *flags, *units, "-o", "program", *FLAGS["libraries"]]
    built = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return folder / "program"


def works(folder: Path, *flags: str) -> bool:
    """Whether this compiler makes a program with these flags, and this machine runs it."""
    (folder / "nothing.c").write_text(PROGRAM, encoding="utf-8")
    command = [*find_compiler().command, *flags, "nothing.c", "-o", "nothing"]
    built = subprocess.run(command, cwd=folder, capture_output=True).returncode == 0
    (folder / "nothing.c").unlink()
    return built and subprocess.run([folder / "nothing"], capture_output=True).returncode == 0


def same_as_python(scene: Scene, output: str) -> None:
    """The program did the run that Python does, so the tools saw what users run."""
    row, steps, status = output.splitlines()
    end = "separated" if scene.effects.uplift else "ok"  # shaken until a body is beside its place
    if end == "ok":
        result = simulate(scene)
    else:
        found = failure_of(scene).result
        assert isinstance(found, Result) and found.history.lift.max() > 0.0
        result = found
    assert status == result.status == end and result.summary["rims_met"]
    time, angle = float(row.split()[0]), float(row.split()[2])
    if end == "separated":  # bouncing is chaotic: the last digits decide when
        assert time == pytest.approx(result.history.time[-1], abs=0.02)
        return
    assert time == pytest.approx(scene.end) and abs(int(steps) - result.counters.steps) < 0.1 * int(steps) + 5
    assert angle == pytest.approx(float(result.history.tilt_angles[-1, 0, 1]), abs=2e-3)


@pytest.mark.parametrize("case", TESTED)
def test_generated_c_is_clean_under_sanitizers(case: str, tmp_path: Path) -> None:
    if not works(tmp_path, *SANITIZERS):
        pytest.skip("this compiler has no AddressSanitizer")
    scene = CASES[case]
    program = compiled(scene, tmp_path, SANITIZERS)
    done = subprocess.run([program], input=inputs(scene), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    same_as_python(scene, done.stdout)


@pytest.mark.slow
def test_a_run_is_clean_under_valgrind(tmp_path: Path) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    scene = CASES["planar"]
    program = compiled(scene, tmp_path, ("-g", "-O1"))
    command = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all", str(program)]
    done = subprocess.run(command, input=inputs(scene), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    same_as_python(scene, done.stdout)


@pytest.mark.parametrize(
    "slip", ["int a[2]; a[argc + 1] = 1; return a[0] * 0;", "volatile int a = 2147483647; a = a + argc; return 0;"]
)
def test_the_sanitizers_do_see_slips(slip: str, tmp_path: Path) -> None:
    """A write past an array and an overflow: both end the program."""
    if not works(tmp_path, *SANITIZERS):
        pytest.skip("this compiler has no AddressSanitizer")
    (tmp_path / "slip.c").write_text(f"int main(int argc, char **argv) {{ (void)argv; {slip} }}\n", encoding="utf-8")
    command = [*find_compiler().command, "-w", *SANITIZERS, "slip.c", "-o", "slip"]
    assert subprocess.run(command, cwd=tmp_path).returncode == 0
    assert subprocess.run([tmp_path / "slip"], capture_output=True).returncode != 0
