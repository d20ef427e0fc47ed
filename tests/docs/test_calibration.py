"""Calibration: its program runs, its difference step is right. The reference of scene files is that of the schema."""

from __future__ import annotations

import re
from dataclasses import replace

import make_scene_reference
import numpy as np
import pytest
from support import ROOT, Array

from msfp_gen import BuildingScene, InputError, load_scene, presets, simulate
from msfp_gen.scene.file.loader import scene_from_table


def test_the_program_finds_the_coefficients(capsys: pytest.CaptureFixture[str]) -> None:
    text = (ROOT / "docs" / "properties.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```python\n(# calibrate.py\n.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    names: dict[str, Array] = {}
    exec(program, names)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    errors = np.abs(names["found"].x - names["true"])  # type: ignore[attr-defined]
    assert np.all(errors < 4 * names["deviation"]) and np.all(errors[:2] < 0.005 * names["true"][:2])
    assert names["deviation"][2] > 100 * names["deviation"][1], "the page says that test 2 does not see surface 4"


def test_the_difference_step_of_the_page_is_better_than_smaller_ones() -> None:
    scene = replace(load_scene("fenz-test2"), output_step=0.1)

    def derivative(step: float, rtol: float) -> Array:
        forces = []
        for factor in (1 + step, 1 - step):
            bearing = scene.bearing.replace(friction=[0.03 * factor, 0.017, 0.017, 0.107])
            run = simulate(replace(scene, bearing=bearing, solver=replace(scene.solver, rtol=rtol)))
            forces.append(run.history.top_force[:, 0])
        return np.asarray((forces[0] - forces[1]) / (2 * step * 0.03))

    exact = derivative(0.01, 1e-8)
    errors = {h: np.linalg.norm(derivative(h, 1e-4) - exact) / np.linalg.norm(exact) for h in (1e-1, 1e-2, 1e-3, 1e-5)}
    assert errors[1e-2] < 0.01 and errors[1e-2] < 0.5 * min(errors[1e-1], errors[1e-3]) and errors[1e-5] > 1


def test_the_reference_of_scene_files_is_what_its_script_writes() -> None:
    page = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    assert page == make_scene_reference.page(), "python docs/make_scene_reference.py writes it again"


def test_the_reference_has_every_key_of_the_schema_and_no_other() -> None:
    """Tables that occur at several places are described at one."""
    described = {path for _, path, _ in make_scene_reference.SECTIONS} | {"bearing.preset", "bearing.sheet"}
    tables = make_scene_reference.TABLES
    nested = (
        r".*\.rotation\..*|records\.scale_to|building\.effects|building\.bearing\.(effects|interface|soil|motion\..*)"
    )
    assert described == {path for kind in tables.values() for path in kind if not re.fullmatch(nested, path)}
    used = set()
    for _, path, kind in make_scene_reference.SECTIONS:
        of_building = kind is BuildingScene or path.startswith("building")
        for key in tables["building" if of_building else "bearing"][path].keys:
            head = path.split(".")[0] or ("building_scene" if of_building else "scene")
            used |= {name for name in (f"{path}.{key}", f"{head}.{key}", key) if name in make_scene_reference.MEANINGS}
    assert set(make_scene_reference.MEANINGS) - used == {"preset", "sheet"}  # of tables that a paragraph describes


@pytest.mark.parametrize(
    ("key", "value"), [("output_step", -1.0), ("duration", "2 m"), ("stop", {"displacement": 0.0}), ("name", 3)]
)
def test_what_the_reference_excludes_is_refused(key: str, value: object) -> None:
    table = {
        "bearing": "fenz-tfp",
        "motion": {"kind": "harmonic", "amplitude": 0.02, "frequency": 0.2},
        "top": {"kind": "rig", "axial_load": 1e5, "stiffness": 1e8},
    }
    assert scene_from_table(table).bearing == presets.bearing("fenz-tfp")
    with pytest.raises(InputError, match=key):
        scene_from_table({**table, key: value})
