"""The numbers that the page of the explorer starts from are those of a run in Python."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

from msfp_gen import InputError, Rotation, build_model, changed_scene, load_scene, presets
from msfp_gen.cli import main
from msfp_gen.report.explore import EXPLORED, explored_scene, fixed_scene, problem_of
from msfp_gen.specification import contract


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


@pytest.mark.parametrize("name", ["fenz-test2", "double-push"])
def test_numbers_of_the_problem_are_those_of_the_scene(name: str) -> None:
    scene = presets.scene(name)
    problem = problem_of(scene, "title")
    data = problem.data
    assert data["surfaces"] and [row[data["values"].index("friction")] for row in data["surfaces"]] == pytest.approx(
        [surface.friction for surface in scene.bearing.surfaces], rel=1e-15
    )
    assert data["numbers"][0] == scene.bearing.gravity and data["numbers"][6] == scene.end
    assert contract.METHODS[data["numbers"][1]].name == scene.solver.method
    knots, columns = unpacked(data["motion"]["knots"]), data["motion"]["coefficients"]
    full = np.zeros((columns["pieces"], 36))
    full[:, columns["columns"]] = unpacked(columns["values"]).reshape(columns["pieces"], -1)
    assert len(knots) == len(full) + 1
    at = knots[:-1]
    assert full.reshape(-1, 6, 6)[:, :3, 0] == pytest.approx(problem.scene.motion.displacement(at), abs=1e-12)
    assert data["axialLoad"] == scene.top.axial_load


def test_fields_of_a_row_stand_where_the_model_puts_them() -> None:
    problem = problem_of(presets.scene("fenz-test2"), "title")
    extension = build_model(problem.scene.bearing.layout, problem.scene.effects).extension
    for name, fields in (("row", extension.ROW), ("extremes", extension.EXTREMES)):
        offset = 0
        for field, shape in fields:
            size = int(np.prod(shape, dtype=int))
            assert problem.data[name][field] == [offset, size]
            offset += size
        assert problem.data[name][""] == [offset, 0]


def test_presets_of_the_page_have_what_a_page_runs() -> None:
    for name in EXPLORED:
        scene = fixed_scene(explored_scene(name))
        assert scene.effects.rims and not scene.effects.uplift


def test_what_a_page_cannot_run_is_named() -> None:
    scene = load_scene("fenz-test2")
    rotating = replace(
        scene,
        top_rotation=Rotation.ramp(0.0, 0.01, duration=1.0),
        effects=replace(scene.effects, top_rotation=True),
    )
    lifting = changed_scene("fenz-test2", {"effects.uplift": True})
    for field, refused in (("top_rotation", rotating), ("effects.uplift", lifting)):
        with pytest.raises(InputError, match=f"^{field}: the explorer runs scenes without"):
            fixed_scene(refused)


def test_without_ziglang_the_remedy_is_named(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("msfp_gen.report.explore.zig_program", lambda: None)
    target = tmp_path / "page.html"
    assert main(["explore", "fenz-test2", "-o", str(target)]) == 2
    error = capsys.readouterr().err
    assert "pip install ziglang" in error and not target.exists()


def test_a_bad_name_of_a_file_is_refused_first(tmp_path, capsys) -> None:
    assert main(["explore", "fenz-test2", "-o", str(tmp_path / "page.pdf")]) == 2
    assert ".html" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
