"""The sign of the displacement across the bearing: on every axis, and the other one on request, in one place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import preset_run

from msfp_gen import InputError, figures
from msfp_gen.cli import main
from msfp_gen.results.files import export_columns
from msfp_gen.results.sign import SIGNS, shown_sign

U, NOT_U = "u₁ = base − top [mm]", "u₁ = top − base [mm]"


def labels(figure: object) -> list[str]:
    axes = figure.axes  # type: ignore[attr-defined]
    return [text for each in axes for text in (each.get_xlabel(), each.get_ylabel(), each.get_title(loc="left"))]


@pytest.mark.parametrize("name", ["overview", "loops", "orbit"])
def test_axes_say_what_u_is(name: str) -> None:
    result = preset_run("fenz-test5")
    assert any(text.endswith(U) for text in labels(figures.FIGURES[name](result, None)))
    with figures.using_sign("top-base"):
        turned = labels(figures.FIGURES[name](result, None))
    assert any(text.endswith(NOT_U) for text in turned) and not any("base − top" in text for text in turned)
    assert shown_sign() == SIGNS["base-top"]


def test_loop_and_section_turn_round() -> None:
    result = preset_run("fenz-test5")
    with figures.using_sign("top-base"):
        loop, section = figures.plot_loops(result), figures.plot_section(result)
    x, y = loop.axes[0].get_lines()[0].get_data()
    np.testing.assert_array_equal(x, -1e3 * result.history.displacement[:, 0])
    np.testing.assert_allclose(y, -1e-3 * result.history.top_force[:, 0])
    assert "force on the bearing" in loop.axes[0].get_ylabel()
    assert "u = top − base = -139.6 mm" in section.axes[0].get_title(loc="left")
    same = figures.plot_section(result)
    for one, other in zip(same.axes[0].patches, section.axes[0].patches, strict=True):
        np.testing.assert_array_equal(one.get_path().vertices, other.get_path().vertices)


def test_exported_tables_state_and_change_the_sign(tmp_path: Path) -> None:
    result = preset_run("fenz-test5")
    before = result.history.displacement.copy()
    names = ["displacement_E1", "top_force_E1", "sliding_1", "base_displacement_E1"]
    rows = {}
    for sign in SIGNS:
        path = export_columns(result, tmp_path / f"{sign}.csv", names, sign)
        assert f"u = {sign.replace('-', ' - ')}, F on the" in path.read_text(encoding="utf-8").partition("\n")[0]
        rows[sign] = np.loadtxt(path, delimiter=",", skiprows=2)
    np.testing.assert_array_equal(rows["top-base"][:, 1:3], -rows["base-top"][:, 1:3])
    np.testing.assert_array_equal(rows["top-base"][:, 3:], rows["base-top"][:, 3:])
    np.testing.assert_array_equal(result.history.displacement, before)
    np.testing.assert_array_equal(result.dataset["displacement"].values, before)


def test_another_word_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match="sign = 'up': give one of base-top, top-base"), figures.using_sign("up"):
        raise AssertionError("drawn")
    for command in (["plot"], ["animate"], ["export"]):
        suffix = {"plot": ".png", "animate": ".gif", "export": ".csv"}[command[0]]
        assert main([*command, "fenz-test1", "-o", str(tmp_path / f"a{suffix}"), "--sign", "up"]) == 2
        assert capsys.readouterr().err == "error: --sign = 'up': give one of base-top, top-base\n"
    assert not list(tmp_path.iterdir())
