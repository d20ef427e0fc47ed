"""Units of bearings that lift off and land again; and units under valgrind."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, Array
from support.ends import BEARING, INTERFACE, LOAD, swing
from support.units import Unit, mass, rig

from msfp_gen import Effects, TwoPort
from msfp_gen.embedding.unit import write_fmu
from msfp_gen.jit.compiler import find_compiler

pytest.importorskip("fmpy")

STEP, OPEN = 0.02, 1.0  # [s]; normal force of a contact that hardly touches, at most [N]
UPLIFT = Effects(uplift=True)


@pytest.mark.slow
def test_a_unit_lifts_off_and_lands_as_the_two_port(tmp_path: Path) -> None:
    """The upper end swings by more than its springs are compressed at rest; bit by bit."""
    path = write_fmu(replace(rig(), effects=UPLIFT), tmp_path / "uplift.fmu").path
    two_port = TwoPort(BEARING, INTERFACE, LOAD, UPLIFT, rig().solver)
    amplitude = np.zeros((2, 6))
    amplitude[1, [0, 2]] = 0.02, 3.0 * LOAD / INTERFACE.vertical_stiffness
    forces = []
    with Unit(path, inputs_at_step_end=True) as unit:
        unit.start()
        for i in range(100):
            ends = swing(STEP * (i + 1), amplitude)
            found, expected = unit.step(STEP * i, STEP, ends), two_port.trial(STEP * i + STEP, *ends)
            two_port.commit()
            assert np.array_equal(found[:12], expected.wrench.ravel())
            assert np.array_equal(found[16:20], expected.normal_force)
            forces.append(found[16:20])
    lowest = np.array(forces).min(axis=1)
    lifted = np.flatnonzero(lowest < OPEN)
    assert 10 < len(lifted) < 60 and lowest[0] > 0.9 * LOAD and lowest[lifted[-1] + 1 :].max() > 2 * LOAD


def shaken(time: float) -> Array:
    """Inputs of a base that moves up and down with 1.2 g at most, from rest."""
    w, found = 2 * np.pi * 4, np.zeros((2, 3, 6))
    rise = min(1.0, time / 0.5)  # by steps of the communication, each with its own amplitude
    amplitude = rise * 1.2 * 9.8 / w**2
    s, c = np.sin(w * time), np.cos(w * time)
    found[0, :, 2] = amplitude * np.array([s, w * c, -(w**2) * s])
    return found


@pytest.mark.slow  # another unit to build
def test_a_supported_mass_lifts_off_and_lands(tmp_path: Path) -> None:
    """A unit for Co-Simulation alone. On the mean the contacts carry the weight, and none of them pulls."""
    scene = replace(mass(), effects=UPLIFT)
    path, step, forces, heights = write_fmu(scene, tmp_path / "bounce.fmu").path, 2e-3, [], []
    with Unit(path, inputs_at_step_end=True) as unit:
        unit.start()
        for i in range(500):
            found = unit.step(step * i, step, shaken(step * (i + 1)))
            forces.append(found[28:32])
            heights.append(found[2] - shaken(step * (i + 1))[0, 0, 2])
    normal = np.array(forces)
    assert normal.min() >= 0.0 and (normal < OPEN).any(axis=1).sum() > 20
    assert max(heights) > 1e-4 and normal.max() > 1.5 * 9.8 * 11e3
    assert normal[250:].mean() == pytest.approx(9.8 * 11e3, rel=0.1)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.parametrize("effects", [Effects(), UPLIFT])
def test_valgrind_finds_nothing_in_a_unit(effects: Effects, tmp_path: Path) -> None:
    """A program in C that steps it, goes back by a serialised state, differentiates, and is refused a damaged state."""
    from fmpy import extract, read_model_description

    path = write_fmu(replace(rig(), effects=effects), tmp_path / "unit.fmu").path
    folder, description = Path(str(extract(str(path), str(tmp_path / "unit")))), read_model_description(str(path))
    (binary,) = (folder / "binaries").rglob("*.so")
    first = next(v.valueReference for v in description.modelVariables if v.causality == "output")
    program, source = tmp_path / "drive", ROOT / "tests" / "support" / "c" / "drive_unit.c"
    flags = ["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Werror", str(binary), f"-Wl,-rpath,{binary.parent}", "-lm"]
    subprocess.run([*find_compiler().command, str(source), *flags, "-o", str(program)], check=True)
    command = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=all"]
    arguments = [str(program), str(description.guid), (folder / "resources").as_uri(), str(first)]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    outputs, again = (np.array(line.split(), dtype=float) for line in done.stdout.splitlines())
    assert np.array_equal(outputs, again) and np.abs(outputs).max() > 0.5 * LOAD
