"""The two-port of the C library: the numbers of Python, bit by bit, and what it refuses."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support import ROOT
from support.ends import BEARING, INTERFACE, LOAD, port, swing
from support.example import example_bearing

from msfp_gen import Solver, Top, TwoPort, cli
from msfp_gen.embedding import values
from msfp_gen.jit.compiler import find_compiler
from msfp_gen.model.compiled import bodies_and_surfaces, top_values

pytestmark = pytest.mark.slow  # a library of its own, compiled for a quarter of a minute
PROGRAM = ROOT / "tests" / "support" / "c" / "two_port.c"
STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic")
STEP, COUNT = 0.02, 40


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("two-port")
    assert cli.main(["export", "5", "2", "2", "--top-rotation", "--prefix", str(folder / "msfp")]) == 0
    library = [f"-I{folder / 'msfp/include'}", str(folder / "msfp/lib/libmsfp.a"), "-lm"]
    command = [*find_compiler().command, *STRICT, str(PROGRAM), *library, "-o", "two_port"]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "two_port"


def given() -> str:
    """What the program reads: a bearing, its interface, and the motions of its ends."""
    two_port, solver = port(), Solver(rtol=1e-4)
    bodies, surfaces = bodies_and_surfaces(BEARING, two_port.model.effects)
    ends = [swing(STEP * (i + 1)) for i in range(COUNT)]
    rows = [BEARING.gravity, bodies, surfaces, top_values(INTERFACE), LOAD, STEP, COUNT]
    rows += [solver.rtol, solver.angle_tolerance, ends]
    return "\n".join(" ".join(repr(float(x)) for x in np.ravel(row)) for row in rows)


def test_wrenches_are_those_of_python_bit_by_bit(program: Path) -> None:
    """A snapshot halfway goes on in a second two-port; a damaged one is refused."""
    done = subprocess.run([program], input=given(), capture_output=True, text=True, check=True)
    *lines, tangent = [np.array(line.split(), dtype=float) for line in done.stdout.splitlines() if "|" not in line]
    two_port = port()
    assert len(lines) == COUNT
    for i, line in enumerate(lines):
        response = two_port.trial(STEP * (i + 1), *swing(STEP * (i + 1)))
        assert np.array_equal(response.wrench.ravel(), line)
        expected = response.tangent if i == COUNT - 1 else None
        two_port.commit()
    assert expected is not None and np.array_equal(expected.ravel(), tangent)
    assert np.abs(lines[-1]).max() > 0.5 * LOAD


def test_what_it_refuses_is_named(program: Path) -> None:
    done = subprocess.run([program], input=given(), capture_output=True, text=True, check=True)
    lines = [line.split("|") for line in done.stdout.splitlines() if "|" in line]
    spoiled = [line for line in lines if "=" in line[0]]
    assert len(spoiled) == 19 and not re.search("a handle|failed start", done.stdout)
    for what, status, message in spoiled:
        assert status == "argument" and re.search("give |leave ", message), (what, message)
        fields = re.split(":", message)[0].split(", ") if "mass" not in what else ["mass"]
        assert any(field in what for field in fields), (what, message)
    others = "no handle, no place for the cause, nothing to commit, no trial, no duration, no direction, reverted"
    assert {what: status for what, status, _ in lines if "=" not in what} == dict.fromkeys(
        others.split(", "), "argument"
    )


def printed(folder: Path, target: str, **flags: str) -> np.ndarray:
    """The numbers that an example of the exported library prints."""
    given = [f"{name}={value}" for name, value in flags.items()]
    done = subprocess.run(["make", "-s", *given, target], cwd=folder, capture_output=True, text=True)
    *lines, last = done.stdout.splitlines()
    assert (done.returncode, done.stderr, last) == (0, "", "ok: the run reached its end"), done.stdout + done.stderr
    return np.array([line.split() for line in lines[1:]], dtype=float)


@pytest.mark.skipif(not all(map(shutil.which, ("make", "pkg-config"))), reason="make or pkg-config is not installed")
def test_the_examples_of_the_library_print_what_python_computes(program: Path) -> None:
    """In C, and where there is a compiler in Fortran."""
    folder = program.parent / "msfp/share/msfp/examples"
    found = printed(folder, "run-port", CFLAGS=" ".join(STRICT))
    two_port = TwoPort(example_bearing(), Top.node(1e9, 3e8, 1e8, 1e4, 1e5, 1e4), values.LOAD)
    w, u = np.pi, 0.5 * values.STROKE
    for i, row in enumerate(found):
        t, upper = 0.05 * (i + 1), np.zeros((3, 6))
        upper[:, 0] = u * (1 - np.cos(w * t)), u * w * np.sin(w * t), u * w**2 * np.cos(w * t)
        response = two_port.trial(t, np.zeros((3, 6)), upper)
        wrench = response.wrench[1]
        expected = [t, 1e3 * upper[0, 0], 1e-3 * wrench[0], 1e-3 * wrench[2], 1e-6 * response.tangent[6, 6]]
        assert row == pytest.approx(expected, abs=1e-4)
        two_port.commit()
    assert len(found) == 40 and found[:, 2].max() > 50
    if shutil.which("gfortran"):
        flags = "-std=f2018 -O1 -Wall -Werror -pedantic -fcheck=all"
        assert np.array_equal(printed(folder, "run-port-fortran", FFLAGS=flags), found)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_finds_nothing(program: Path) -> None:
    command = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full", "--show-leak-kinds=all", str(program)]
    done = subprocess.run(command, input=given(), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
