"""Tables of other programs as histories, by a map of columns."""

from __future__ import annotations

import numpy as np
import pytest

from msfp_gen import InputError, load_scene, simulate, using_sign
from msfp_gen.auditing import read_histories
from msfp_gen.auditing.histories import histories_of
from msfp_gen.results.files import save

ROWS = np.arange(40)


def lines(*columns, separator=","):
    return [separator.join(f"{value:.6g}" for value in row) for row in np.column_stack(columns)]


def test_a_csv_with_units_in_the_map(tmp_path):
    """As MASTODON writes it: plain names, compression negative."""
    file = tmp_path / "out.csv"
    file.write_text("\n".join(["time,d,fx,fz", *lines(0.01 * ROWS, 1e-3 * ROWS, 2e-3 * ROWS, -0.5 + 0 * ROWS)]))
    columns = {"time": "time [s]", "displacement_1": "d [m]", "force_1": "fx [GN]", "axial": "-fz [GN]"}
    found = read_histories(file, {"columns": columns, "mass": "3 Gg", "bearings": 7})
    assert found.columns["force_1"][-1] == pytest.approx(39 * 2e6)
    assert found.axial[0] == pytest.approx(0.5e9)
    assert (found.mass, found.bearings) == (pytest.approx(3e6), 7.0)


def test_a_line_of_units_below_the_header(tmp_path):
    """As ETABS and SAP2000 export tables; a title stands above."""
    file = tmp_path / "links.txt"
    head = ["TABLE:  Element Forces - Links", "Time\tP\tV2\tU2", "sec\tkN\tkN\tmm"]
    file.write_text("\n".join([*head, *lines(0.02 * ROWS, -100 - ROWS, ROWS, 2 * ROWS, separator="\t")]))
    found = read_histories(file, {"columns": {"time": "Time", "axial": "-P", "force_2": "V2", "displacement_2": "U2"}})
    assert found.axial[-1] == pytest.approx(139e3)
    assert found.displacement[-1].tolist() == pytest.approx([0.0, 0.078])
    assert found.missing("force", "acceleration", "rise") == ["acceleration", "rise"]


def test_recorders_without_a_header(tmp_path):
    """As OpenSees writes them: one file for each quantity, one with a row more, a first row twice."""
    (tmp_path / "force.out").write_text("\n".join(lines([0.0, *0.01 * ROWS], [0, *ROWS], [0, *-ROWS], separator=" ")))
    (tmp_path / "disp.out").write_text("\n".join(lines([0.0, *0.01 * ROWS], [0, *ROWS], separator=" ")))
    (tmp_path / "map.toml").write_text(
        '[columns]\ntime = "#1 [s]"\nforce_1 = "#2 [kip]"\nforce_2 = "-#3 [kip]"\n'
        'displacement_1 = {file = "disp.out", column = "#2 [inch]"}\n'
    )
    found = read_histories(tmp_path / "force.out", tmp_path / "map.toml")
    assert len(found.time) == 40 and found.time[0] == 0.0
    assert found.force[-1] == pytest.approx([39 * 4448.2216, 39 * 4448.2216])
    assert found.displacement[-1, 0] == pytest.approx(39 * 0.0254)


ROTATIONS = [f"{end}_rotation_{axis}" for end in ("lower", "upper") for axis in (1, 2)]


@pytest.mark.parametrize(("suffix", "sign"), [(".csv", "base-top"), (".csv", "top-base"), (".nc", "base-top")])
def test_results_of_this_package_need_no_map(tmp_path, suffix, sign):
    result = simulate(load_scene("fenz-test2"))
    with using_sign(sign):
        found = read_histories(save(result, tmp_path / f"run{suffix}"))
    own = histories_of(result)
    assert own.columns.keys() - found.columns.keys() == ({*ROTATIONS} if suffix == ".csv" else set())
    for name, values in found.columns.items():
        assert np.allclose(own.columns[name], values, rtol=1e-12, atol=0), name


@pytest.mark.parametrize(
    ("text", "table", "words"),
    [
        ("t,f\n", {"columns": {"time": "t [s]"}}, "no rows of numbers"),
        ("t,f\n0,1\n1,2\n", {"columns": {"time": "t [s]"}}, "2 rows"),
        ("t,f\n0,1\n1\n", {"columns": {"time": "t [s]"}}, "line 3"),
        ("", {"columns": {"time": "t [s]", "shear": "f [N]"}}, "columns.shear"),
        ("", {"columns": {"time": "t [s]", "force_1": "g [N]"}}, "no column 'g'"),
        ("", {"columns": {"time": "t [s]", "force_1": "f"}}, "has no unit"),
        ("", {"columns": {"time": "t [s]", "force_1": "f [mm]"}}, "column 'f': the unit 'mm'"),
        ("", {"columns": {"time": "t [s]", "force_1": "#9 [N]"}}, "#1 to #2"),
        ("", {"columns": {"force_1": "f [N]"}}, "no column time"),
        ("", {"columns": {"time": "f [s]", "force_1": "t [N]"}}, "does not increase"),
        ("", {"columns": {"time": "t [s]"}, "mass": "3 m"}, "map.mass"),
        ("", {"columns": {"time": "t [s]"}, "bearings": 0}, "map.bearings"),
        ("", {"columns": {"time": "t [s]", "force_1": 3}}, "map.columns.force_1"),
        ("", {"column": {}}, "map.column"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, text, table, words):
    file = tmp_path / "out.csv"
    whole = "\n".join(["t,f", *lines(ROWS, 0 * ROWS + 1)])
    file.write_text(text or whole)
    with pytest.raises(InputError, match=r"out\.csv|map") as error:
        read_histories(file, table)
    assert words in str(error.value)


@pytest.mark.parametrize(("number", "unit"), [("nan", "N"), ("1e308", "kN")])
def test_numbers_that_are_missing_or_out_of_range_are_named(tmp_path, number, unit):
    file = tmp_path / "out.csv"
    file.write_text("\n".join(["t,f", *lines(ROWS, ROWS)]).replace("7,7", f"7,{number}"))
    with pytest.raises(InputError, match=r"out.csv: force_1"):
        read_histories(file, {"columns": {"time": "t [s]", "force_1": f"f [{unit}]"}})
