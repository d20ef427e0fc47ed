"""Target spectra for scaling: EN 1998-1 by hand, tables in files and in scenes, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from msfp_gen import InputError, load_scene
from msfp_gen.motions.records import baseline_corrected, bundled, response_spectrum
from msfp_gen.motions.records.scaling import EN1998, ScaleTo, en1998_spectrum, read_spectrum, tabulated_spectrum
from msfp_gen.motions.records.spectrum import measure_index
from msfp_gen.scene.file.loader import load_suite, toml_file
from msfp_gen.scene.file.source import with_absolute_paths

TABLE = "# target of the site\nperiod [s], Sa [g]\n0.1, 0.5\n1, 0.4\n5, 0.05\n"
G = 9.80665


def put(folder: Path, text: str = TABLE) -> Path:
    (folder / "target.csv").write_text(text)
    return folder / "target.csv"


@pytest.mark.parametrize(
    ("period", "expected"),
    [
        (0.0, 1.2),  # S
        (0.075, 1.2 * (1 + 0.5 * 1.5)),  # (3.2), half way to T_B = 0.15 s
        (0.15, 3.0),  # (3.3), 2.5 S
        (0.5, 3.0),  # T_C
        (1.0, 1.5),  # (3.4), 2.5 S T_C/T
        (2.0, 0.75),  # T_D
        (4.0, 0.1875),  # (3.5), 2.5 S T_C T_D/T^2
    ],
)
def test_type_1_on_ground_b_by_hand(period: float, expected: float) -> None:
    assert en1998_spectrum([period], 1.0, "B")[0] == pytest.approx(expected, rel=1e-12)


def test_damping_reduces_the_plateau_and_not_the_ground_acceleration() -> None:
    """(3.6): sqrt(10/15) at 10 %, and 0.55 at the most."""
    plateau = [en1998_spectrum([0.0, 0.3], 2.0, "A", damping=damping) for damping in (0.05, 0.1, 0.5)]
    assert [values[0] for values in plateau] == [2.0, 2.0, 2.0]
    assert [values[1] for values in plateau] == pytest.approx([5.0, 5.0 * np.sqrt(10 / 15), 2.75])


@pytest.mark.parametrize(("kind", "ground"), EN1998)
def test_every_shape_is_continuous(kind: int, ground: str) -> None:
    corners = np.array(EN1998[kind, ground][1:])
    sides = [en1998_spectrum(corners * (1 + side), 1.0, ground, kind) for side in (-1e-9, 1e-9)]
    assert sides[0] == pytest.approx(sides[1], rel=1e-7)


def test_a_table_has_its_units_and_is_linear_in_logarithms(tmp_path: Path) -> None:
    pairs = read_spectrum(put(tmp_path))
    np.testing.assert_allclose(pairs, [(0.1, 0.5 * G), (1.0, 0.4 * G), (5.0, 0.05 * G)], rtol=1e-15)
    between = tabulated_spectrum([np.sqrt(5.0)], pairs)
    assert between[0] == pytest.approx(G * np.sqrt(0.4 * 0.05))


@pytest.mark.parametrize("text", ["ag=0.3 g, ground=C, spectrum_type=2, between=0.5:3", "spectrum={}, between=0.5:3"])
def test_a_scaled_record_meets_the_spectrum(text: str, tmp_path: Path) -> None:
    """In the mean of the logarithms over the periods of the fit."""
    target = ScaleTo.parse(text.format(put(tmp_path)))
    motion = baseline_corrected(bundled("ridgecrest-2019-ci-clc"), duration=30.0)
    periods, wanted = target.ordinates()
    psa = response_spectrum(motion.scaled(target.factor(motion)), periods).psa[:, measure_index("rotd50")]
    assert np.log(psa / wanted).mean() == pytest.approx(0.0, abs=1e-9)


SCENE = """
bearing = "prototype-tfp"
[motion]
kind = "record"
bundled = "ridgecrest-2019-ci-clc"
duration = 10.0
scale_to = {{ spectrum = {}, between = [0.5, 4.0] }}
[top]
kind = "rig"
axial_load = 112e3
stiffness = 1e8
"""


def test_a_scene_names_the_file_or_has_the_rows(tmp_path: Path) -> None:
    """Relative to its folder; scenes of studies, and results, have the rows themselves."""
    put(tmp_path)
    rows = [[0.1, 0.5 * G], [1.0, 0.4 * G], [5.0, 0.05 * G]]
    scenes = []
    for name, given in (("file", '"target.csv"'), ("rows", str(rows))):
        (tmp_path / f"{name}.toml").write_text(SCENE.format(given))
        scenes.append(load_scene(tmp_path / f"{name}.toml"))
    assert scenes[0].motion == scenes[1].motion
    moved = with_absolute_paths(toml_file(tmp_path / "file.toml"), tmp_path)
    assert moved["motion"]["scale_to"]["spectrum"] == [pytest.approx(row) for row in rows]


def test_a_suite_names_the_file(tmp_path: Path) -> None:
    put(tmp_path)
    (tmp_path / "suite.toml").write_text(
        '[[records]]\nbundled = "ridgecrest-2019-ci-clc"\nduration = 10.0\n'
        '[scale_to]\nspectrum = "target.csv"\nbetween = [0.5, 4.0]\nleast_share = 1.0\n'
    )
    scaled = load_suite(tmp_path / "suite.toml").scaled
    assert scaled is not None and scaled.least_share == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("ag=3, ground=B, between=0.5:5", r"between = \[0.5, 5.0\]: the target has periods from 0 to 4 s; stay within"),
        ("ag=3, ground=F, between=0.5:4", "ground = 'F': give one of"),
        ("ag=3, ground=B, spectrum_type=3, between=1:2", "spectrum_type = 3: give 1, or 2 for magnitudes up to 5.5"),
        ("ag=3, between=1:2", "ag, between given; give pga, or sa and period, .* or ag, ground and between"),
        ("spectrum={}, between=0.5:8", "the target has periods from 0.1 to 5 s; stay within"),
        ("spectrum=missing.csv, between=0.5:4", "missing.csv: cannot be read"),
    ],
)
def test_what_is_no_target_is_refused(text: str, remedy: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=remedy):
        ScaleTo.parse(text.format(put(tmp_path)))


@pytest.mark.parametrize(
    ("table", "remedy"),
    [
        ("period [s], Sa [kg]\n1, 1\n2, 1\n", "line 1: column Sa: the unit 'kg'"),
        ("period [s], Sa [g], Sv [m/s]\n1, 1, 1\n", "line 1: the header is .* give two columns with units"),
        ("period [s], Sa [g]\n1, 1, 3\n", "line 2: 3 columns, the header names 2"),
        ("period [s], Sa [g]\n2, 1\n1, 1\n", "two or more rows of rising periods"),
        ("period [s], Sa [g]\n1, 1\n2, 0\n", "accelerations above zero"),
        ("# nothing\n", "no header; begin with: period"),
    ],
)
def test_a_bad_table_names_its_line(table: str, remedy: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=remedy):
        ScaleTo(spectrum=str(put(tmp_path, table)), between=(0.5, 4.0))
