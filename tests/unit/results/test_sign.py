"""The sign of the displacement across the bearing: on every axis, and the other one on request, in one place."""

from __future__ import annotations

import base64
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import preset_run
from support.buildings import pushed

from msfp_gen import InputError, changed_scene, figures, load_result, simulate, using_sign
from msfp_gen.cli import main
from msfp_gen.report import write_report
from msfp_gen.report.explore import problem_of
from msfp_gen.results.files import export_columns, save
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
        with using_sign(sign):
            path = export_columns(result, tmp_path / f"{sign}.csv", names)
        assert f"u = {sign.replace('-', ' - ')}, F on the" in path.read_text(encoding="utf-8").partition("\n")[0]
        rows[sign] = np.loadtxt(path, delimiter=",", skiprows=2)
    np.testing.assert_array_equal(rows["top-base"][:, 1:3], -rows["base-top"][:, 1:3])
    np.testing.assert_array_equal(rows["top-base"][:, 3:], rows["base-top"][:, 3:])
    np.testing.assert_array_equal(result.history.displacement, before)
    np.testing.assert_array_equal(result.dataset["displacement"].values, before)


def test_another_word_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match="sign = 'up': give one of base-top, top-base"), figures.using_sign("up"):
        raise AssertionError("drawn")
    suffixes = {
        "plot": ".png",
        "animate": ".gif",
        "export": ".csv",
        "run": ".nc",
        "report": ".html",
        "bound": "",
        "batch": "",
    }
    for command, suffix in (suffixes | {"explore": ".html"}).items():
        assert main([command, "fenz-test1", "-o", str(tmp_path / f"a{suffix}"), "--sign", "up"]) == 2
        assert capsys.readouterr().err == "error: --sign = 'up': give one of base-top, top-base\n"
    assert not list(tmp_path.iterdir())


def _csv(result: Any, path: Path) -> tuple[Any, str]:
    export_columns(result, path.with_suffix(".csv"), ["displacement_E1", "top_force_E1"])
    text = path.with_suffix(".csv").read_text(encoding="utf-8")
    return np.loadtxt(path.with_suffix(".csv"), delimiter=",", skiprows=2)[:, 1:], text.partition("\n")[0]


def _parquet(result: Any, path: Path) -> tuple[Any, str]:
    import pyarrow.parquet

    export_columns(result, path.with_suffix(".parquet"), ["displacement_E1", "top_force_E1"])
    table = pyarrow.parquet.read_table(path.with_suffix(".parquet"))
    return np.column_stack([table[1], table[2]]), table.schema.metadata[b"sign"].decode()


def _netcdf(result: Any, path: Path) -> tuple[Any, str]:
    import xarray as xr

    with xr.open_dataset(result.to_netcdf(path.with_suffix(".nc")), engine="h5netcdf") as file:
        found = np.column_stack([file["displacement"][:, 0], file["top_force"][:, 0]])
        return found, str(file["displacement"].attrs.get("sign", "base less top")).replace("less", "-")


def _matlab(result: Any, path: Path) -> tuple[Any, str]:
    from scipy.io import loadmat

    file = loadmat(save(result, path.with_suffix(".mat")))
    word = file["attributes"][0, 0]
    said = str(word["sign"][0]) if "sign" in (word.dtype.names or ()) else "base-top"
    return np.column_stack([file["displacement"][:, 0], file["top_force"][:, 0]]), said.replace("-", " - ")


def _gradient(result: Any, path: Path) -> tuple[Any, str]:
    import xarray as xr

    with xr.open_dataset(result.to_netcdf(path.with_suffix(".nc")), group="gradient", engine="h5netcdf") as file:
        found = np.column_stack([file["displacement"][0, :, 0], file["top_force"][0, :, 0]])
        return found, str(file["displacement"].attrs.get("sign", "base less top")).replace("less", "-")


def _page(result: Any, path: Path) -> tuple[Any, str]:
    html = write_report(result, path.with_suffix(".html"), 600).read_text(encoding="utf-8")
    data = json.loads(html.partition('id="report-data">')[2].partition("</script>")[0])
    columns = []
    for name in ("displacement", "top_force"):
        packed = data["frames"][name]
        columns.append(np.frombuffer(base64.b64decode(packed["data"]), "<f4").reshape(packed["shape"])[:, 0])
    (words,) = re.findall(r"displacement across the bearing: (.*?), less its value", html)
    assert data["sign"]["difference"].replace("−", "less") == words and f"= {data['sign']['difference']} =" in html
    return np.column_stack(columns), words.replace("less", "-")


def _explorer(result: Any, path: Path) -> tuple[Any, str]:
    sign = problem_of(result.scene, "a title").data["sign"]
    return np.full((3, 2), sign["factor"]), sign["difference"].replace("−", "-")


def _loop(result: Any, path: Path) -> tuple[Any, str]:
    axes = figures.plot_loops(result).axes[0]
    return np.column_stack(axes.get_lines()[0].get_data()), axes.get_xlabel().replace("−", "-")


@pytest.mark.parametrize("output", [_csv, _parquet, _netcdf, _matlab, _gradient, _page, _explorer, _loop])
def test_one_setting_turns_every_output(output: Any, tmp_path: Path) -> None:
    result = with_gradients() if output is _gradient else preset_run("fenz-test1")
    before, said = output(result, tmp_path / "before")
    with using_sign("top-base"):
        after, says = output(result, tmp_path / "after")
    assert np.abs(before).max() > 0
    np.testing.assert_array_equal(after, -before)
    assert "base - top" in said and "top - base" in says


def test_runs_of_a_batch_are_written_in_the_sign_of_the_command(tmp_path: Path) -> None:
    import xarray as xr

    for sign in SIGNS:
        assert main(["batch", "fenz-test1", "-o", str(tmp_path / sign), "--sign", sign]) == 0
    with (
        xr.open_dataset(next((tmp_path / "base-top").iterdir()), engine="h5netcdf") as one,
        xr.open_dataset(next((tmp_path / "top-base").iterdir()), engine="h5netcdf") as other,
    ):
        np.testing.assert_array_equal(one["displacement"], -other["displacement"])
        assert np.abs(one["displacement"]).max() > 0


@cache
def with_gradients() -> Any:
    scene = changed_scene("fenz-test1", {"duration": 3.0})
    return simulate(scene, gradients=["bearing.surfaces[*].friction"], gradient_errors=False)


def test_a_result_file_of_either_sign_is_the_same_result(tmp_path: Path) -> None:
    """Rows, events and derivatives; the summary has magnitudes, which no sign changes."""
    for result in (with_gradients(), preset_run("fenz-test5")):
        with using_sign("top-base"):
            path = result.to_netcdf(tmp_path / f"{result.scene.name}.nc")
        again = load_result(path)
        for name, values in result.dataset.variables.items():
            np.testing.assert_array_equal(again.dataset[name].to_numpy(), values.to_numpy(), err_msg=str(name))
        assert again.summary == result.summary
        assert "sign" not in again.dataset.attrs
        if result.gradients is not None:
            for name, derivatives in result.gradients.arrays.items():
                np.testing.assert_array_equal(again.gradients.arrays[name], derivatives, err_msg=name)


def test_a_building_has_one_sign_too(tmp_path: Path) -> None:
    """Displacements across its bearings and their forces on it; not floors, drifts and the wrenches of the ends."""
    import xarray as xr

    result = pushed()
    with using_sign("top-base"):
        path = result.to_netcdf(tmp_path / "turned.nc")
        export_columns(result, tmp_path / "turned.csv", ["bearing_displacement_1_E1", "drift"])
    with xr.open_dataset(path, engine="h5netcdf") as file:
        for name, values in result.dataset.data_vars.items():
            factor = -1.0 if name in ("bearing_displacement", "top_force") else 1.0
            if values.dtype.kind == "f":
                np.testing.assert_array_equal(file[name].to_numpy(), factor * values.to_numpy(), err_msg=str(name))
        assert file["bearing_displacement"].attrs["sign"] == "top less base"
        assert file["top_force"].attrs["sign"] == "on the bearing"
    again = load_result(path)
    np.testing.assert_array_equal(again.dataset["bearing_displacement"], result.dataset["bearing_displacement"])
    assert "u = top - base" in (tmp_path / "turned.csv").read_text(encoding="utf-8").partition("\n")[0]
