"""A folder of generated sources explains itself: README, Makefile and example, of which the last is built and run."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support import ROOT, Array

from msfp_gen import Bearing, Body, Effects, InputError, Layout, Motion, Scene, Solver, Surface, Top, cli, simulate
from msfp_gen.embedding import GUIDE, values, write_guide
from msfp_gen.specification import contract, rows
from msfp_gen.specification.layout import ModelSpec

STRICT = "-std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -ffp-contract=off"
MAKE = shutil.which("make")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("guide") / "model"
    assert cli.main(["generate", "5", "2", "2", "-o", str(target)]) == 0
    return target


def make(folder: Path, *goals: str) -> str:
    command = ["make", "-s", "-j2", f"CFLAGS={STRICT}", *goals]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return done.stdout


@pytest.mark.skipif(MAKE is None, reason="make is not installed")
def test_the_example_builds_without_warnings_and_runs_as_python_does(folder: Path) -> None:
    lines = make(folder, "run").splitlines()
    assert lines[-1].startswith("ok after ")
    rows = np.array([line.split() for line in lines[1:-1]], dtype=float)
    history = simulate(scene()).history
    np.testing.assert_allclose(rows[:, 0], history.time, atol=1e-3)
    np.testing.assert_allclose(rows[:, 1], 1e3 * history.displacement[:, 0], atol=1e-3)
    np.testing.assert_allclose(rows[:, 2], 1e-3 * history.top_force[:, 0], atol=0.01)
    np.testing.assert_allclose(rows[:, 3], 1e-3 * history.normal_force[:, 0], atol=0.01)
    assert rows[-1, 2] > 50


def scene() -> Scene:
    """The bearing of the example as a scene."""
    found = values.example(ModelSpec(Layout.tfp(), Effects()))
    bodies = [dict(zip(contract.names(contract.BODY), row, strict=True)) for row in found.bodies]
    surfaces = [dict(zip(contract.names(contract.SURFACE), row, strict=True)) for row in found.surfaces]
    inertia = ("inertia_transverse", "inertia_axial")
    bearing = Bearing(
        layout=Layout.tfp(),
        base_height=bodies[0]["height"],
        gravity=values.GRAVITY,
        surfaces=[Surface(**row) for row in surfaces],
        bodies=[
            Body(**{k: v for k, v in row.items() if k not in inertia}, inertia=(row[inertia[0]], row[inertia[1]]))
            for row in bodies[1:]
        ],
    )
    names = ("stiffness", "damping", "rotational_stiffness", "rotational_damping")
    top = dict(zip(contract.names(contract.TOP), found.top, strict=True))
    return Scene(
        bearing=bearing,
        motion=Motion.ramp(values.ACCELERATION, values.DURATION),
        top=Top.rig(axial_load=values.LOAD, **{name: top[name] for name in names}),
        effects=Effects(),
        solver=Solver(rtol=1e-4),
        output_step=values.OUTPUT_STEP,
    )


@pytest.mark.skipif(MAKE is None, reason="make is not installed")
def test_a_history_changed_between_two_calls_counts(folder: Path) -> None:
    make(folder)
    example = (folder / "example.c").read_text(encoding="utf-8")
    tables = re.findall(r"static const double (?:bodies|surfaces|top).*?^};", example, flags=re.DOTALL | re.MULTILINE)
    (folder / "values.h").write_text('#include "msfp_model.h"\n' + "\n".join(tables) + "\n", encoding="utf-8")
    shutil.copy(ROOT / "tests" / "support" / "c" / "changed_load.c", folder)
    command = ["cc", *STRICT.split(), "changed_load.c", "libmsfp_5_2_2.a", "-lm", "-o", "changed"]
    built = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    printed = subprocess.run([folder / "changed"], capture_output=True, text=True, check=True).stdout.splitlines()
    runs: dict[str, Array] = {}
    for name in ("pieces", "changed", "constant"):
        lines = [line.split() for line in printed if line.startswith(name)]
        assert lines[-1][1:] == ["status", "0"]
        runs[name] = np.array([line[1:] for line in lines[:-1]], dtype=float)
    np.testing.assert_allclose(runs["changed"], runs["pieces"], rtol=1e-9, atol=1e-6)
    assert runs["changed"][-1, 1] > 1.7 * runs["constant"][-1, 1]


def test_readme_names_every_file_value_and_status(folder: Path) -> None:
    text = (folder / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`([\w.]+)`", text))
    own = {"libmsfp_5_2_2.a", "example", "values.h", "changed_load.c", "changed"}  # built by the tests above
    files = {path.name for path in folder.iterdir()} - own - set(GUIDE)
    assert {name for name in files if not name.endswith((".o", ".so", ".pyd"))} <= named
    spec = ModelSpec(Layout.tfp(), Effects())
    for entries in (contract.BODY, contract.SURFACE, contract.TOP, rows.row(spec.effects), contract.EVENT_KINDS):
        for entry in entries:
            assert entry.meaning in text, entry.name
    assert {status.name for status in contract.STATUSES if status.compiled} <= named
    header = (folder / "msfp_model.h").read_text() + (folder / "msfp_runtime.h").read_text()
    for word in re.findall(r"\b(?:MSFP_[A-Z_0-9]+|msfp_[a-z_]+(?=\())", text):
        if not word.endswith("_"):
            assert re.search(rf"\b{word}\b", header), f"{word} is in no header"


@pytest.mark.parametrize(
    ("layout", "effects"),
    [
        (Layout(2, 1, 0), Effects(dimension="planar", sliders="massless")),
        (Layout(3, 0, 2), Effects(friction="pvt", uplift=True)),
        (Layout(7, 3, 3), Effects(friction="custom", friction_law="mu * (1 - c1 * exp(-c2 * v))", top_rotation=True)),
    ],
)
def test_the_tables_fit_every_model(layout: Layout, effects: Effects, tmp_path: Path) -> None:
    """Without compiling: as many numbers as the contract has names, and sound text."""
    spec = ModelSpec(layout, effects)
    write_guide(spec, tmp_path, "msfp_model")
    found = values.example(spec)
    assert {len(row) for row in found.surfaces} == {len(contract.surface_values(effects))}
    assert len(found.bodies) == layout.n and len(found.surfaces) == layout.surfaces
    example, readme = ((tmp_path / name).read_text(encoding="utf-8") for name in ("example.c", "README.md"))
    assert ("support" in example) == effects.top_rotation and "[[" not in example.replace("[[]]", "")
    assert effects.law is None or all(f"| {name} |" in readme for name in effects.law.columns)


def test_files_of_the_user_are_not_replaced(tmp_path: Path) -> None:
    spec = ModelSpec(Layout.tfp(), Effects())
    write_guide(spec, tmp_path, "msfp_5_2_2")
    write_guide(spec, tmp_path, "msfp_5_2_2")
    (tmp_path / "example.c").write_text("int main(void) { return 0; }\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"msfp-gen did not write example\.c: move it away"):
        write_guide(spec, tmp_path, "msfp_5_2_2")
    assert (tmp_path / "example.c").read_text(encoding="utf-8").startswith("int main")
