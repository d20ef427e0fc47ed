"""Bounding analysis: the codes' formulas, bad tables, closed forms of the bounds, and what the command leaves."""

from __future__ import annotations

import csv
import dataclasses
import json
import re
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from support import ROOT
from support.synthetic import loops

from msfp_gen import (
    Auto,
    Bearing,
    Body,
    Effects,
    InputError,
    Layout,
    Motion,
    RunError,
    Scene,
    Solver,
    Surface,
    Top,
    changed_scene,
    load_scene,
    presets,
    study,
)
from msfp_gen.cli import main
from msfp_gen.figures.style import COLOURS, distinct_colours
from msfp_gen.results.quantities import ColumnSource, RunQuantity, quantities
from msfp_gen.scene.file.loader import scene_text, toml_table
from msfp_gen.studies import read_study
from msfp_gen.studies.bounding import (
    CASES,
    Bounds,
    SuiteBounds,
    bound,
    bound_suite,
    bounded_scenes,
    factor_tables,
    load_factors,
    load_suite_bounds,
    suite_study,
)
from msfp_gen.studies.bounding.factors import _read
from msfp_gen.studies.bounding.runs import _scaled, bounded_scene, bounding_tables, plot_bounds
from msfp_gen.studies.bounding.suite import suite_bound_tables, uplift_words
from msfp_gen.studies.workers import Workers

ASCE = ((1 + 0.75 * 0) * 0.7 * 0.85, (1 + 0.75 * (1.3 * 1.2 - 1)) * 1.3 * 1.15)


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def pair(table: Any) -> tuple[float, float]:
    (factor,) = table.factors
    found: tuple[float, float] = table.combined(factor)
    return found


def test_asce_adjusts_the_product_of_environmental_factors() -> None:
    assert pair(load_factors("asce7")) == pytest.approx(ASCE)
    assert pair(load_factors("asce7-quality")) == pytest.approx((0.95 * 0.85, (1 + 0.75 * 0.21) * 1.2 * 1.15))


def test_asce_lower_factors_are_adjusted_the_same_way(tmp_path: Path) -> None:
    """lambda_min = (1 - 0.75 (1 - lambda_ae,min)) lambda_test,min."""
    text = (
        'rule = "asce7"\n[[factor]]\nproperty = "friction"\nenvironment = { a = [0.8, 1] }\ndirect = { t = [0.9, 1] }\n'
    )
    assert pair(load_factors(written(tmp_path, text))) == pytest.approx(((1 - 0.75 * 0.2) * 0.9, 1.0))


@pytest.mark.parametrize(("name", "adjustment"), [("en1998-2", 0.70), ("aashto", 0.75)])
def test_european_and_bridge_rules_adjust_each_factor(name: str, adjustment: float) -> None:
    low, high = pair(load_factors(name))
    assert low == 1.0
    assert high == pytest.approx((1 + adjustment * 0.1) * (1 + adjustment * 0.2))


def test_limits_hold_where_the_factors_do_not_reach_them(tmp_path: Path) -> None:
    text = 'rule = "asce7"\nlimits = [0.6, 1.8]\n[[factor]]\nproperty = "friction"\ndirect = { test = [0.9, 1.2] }\n'
    path = written(tmp_path, text)
    assert pair(load_factors(path)) == (0.6, 1.8)
    path.write_text(text.replace("limits = [0.6, 1.8]\n", ""), encoding="utf-8")
    assert pair(load_factors(path)) == pytest.approx((0.9, 1.2))


def test_every_table_that_comes_along_says_where_it_is_from() -> None:
    known = factor_tables()
    assert set(known) == {"aashto", "asce7", "asce7-quality", "en1998-2"} and all(known.values())
    for name in known:
        table = load_factors(name)
        low, high = pair(table)
        assert table.source and low <= 1 <= high


def test_a_printed_table_is_a_file_that_reads_back(tmp_path: Path, capsys: Any) -> None:
    assert main(["factors", "en1998-2"]) == 0
    path = written(tmp_path, capsys.readouterr().out)
    assert dataclasses.replace(load_factors(path), name="en1998-2") == load_factors("en1998-2")
    assert main(["factors"]) == 0
    out = capsys.readouterr().out
    assert all(name in out and description in out for name, description in factor_tables().items())


PAGE = (ROOT / "docs" / "properties.md").read_text(encoding="utf-8").split("\n## Bounds of the properties\n")[1]
RESULTS = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")


def test_the_page_shows_a_table_that_loads_and_numbers_that_come_out(tmp_path: Path) -> None:
    (block,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    table = load_factors(written(tmp_path, block))
    assert [factor.surfaces for factor in table.factors] == [(1, 4), (2, 3)]
    for name in factor_tables():
        numbers = re.search(rf"^\| `{name}` \| ([\d.]+), ([\d.]+) \|", PAGE, flags=re.MULTILINE)
        assert numbers is not None
        assert pair(load_factors(name)) == pytest.approx([float(number) for number in numbers.groups()], abs=5e-4)


@pytest.mark.parametrize("text", [PAGE, RESULTS], ids=["bounds", "results"])
def test_python_on_the_pages_runs(text: str, capsys: Any) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block, names)
    assert blocks and capsys.readouterr().out.strip()


FRICTION = '[[factor]]\nproperty = "friction"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rule = \n", ["no valid TOML"]),
        (f"rule = 0x{'f' * 4000}\n", ["mine.toml: rule: a whole number has more than 64 bits"]),
        (FRICTION + "direct = { test = [0.9, 1.1] }\n", ["rule is missing", "asce7", "aashto"]),
        ('rule = "asce"\n' + FRICTION, ["rule = 'asce'", "asce7"]),
        ('rule = "aashto"\n' + FRICTION + "direct = { test = [0.9, 1.1] }\n", ["adjustment is missing", "0.66"]),
        ('rule = "asce7"\nadjustment = 75\n' + FRICTION + "direct = { t = [1, 1] }\n", ["adjustment = 75", "0.75"]),
        ('rule = "asce7"\nadjustment = nan\n' + FRICTION + "direct = { t = [1, 1] }\n", ["adjustment = nan"]),
        ('rule = "asce7"\nlimits = [1.8, 0.6]\n' + FRICTION + "direct = { t = [1, 1] }\n", ["limits", "least <= 1"]),
        ('rule = "asce7"\n', ["factor is missing", "[[factor]]"]),
        ('rule = "asce7"\nfactor = 3\n', ["factor is missing"]),
        ('rule = "asce7"\nadjustmnt = 1\n' + FRICTION, ["adjustmnt: unknown key", "adjustment"]),
        ('rule = "asce7"\n' + FRICTION + "enviroment = { a = [1, 1] }\n", ["factor[0].enviroment", "environment"]),
        ('rule = "asce7"\n[[factor]]\ndirect = { t = [1, 1] }\n', ["factor[0].property is missing", "friction"]),
        ('rule = "asce7"\n[[factor]]\nproperty = "mu"\n', ["factor[0].property = 'mu'"]),
        ('rule = "asce7"\n' + FRICTION, ["factor[0]: no causes"]),
        ('rule = "asce7"\n' + FRICTION + "direct = 3\n", ["factor[0].direct = 3", "causes"]),
        ('rule = "asce7"\n' + FRICTION + "direct = { test = 1.1 }\n", ["factor[0].direct.test = 1.1"]),
        ('rule = "asce7"\n' + FRICTION + "direct = { test = [1.1, 1.2] }\n", ["factor[0].direct.test", "least <= 1"]),
        ('rule = "asce7"\n' + FRICTION + "direct = { test = [-1, 1.2] }\n", ["factor[0].direct.test", "above 0"]),
        ('rule = "asce7"\n' + FRICTION + "direct = { test = [0.9, inf] }\n", ["factor[0].direct.test", "finite"]),
        ('rule = "asce7"\n' + FRICTION + "surfaces = [0]\ndirect = { t = [1, 1] }\n", ["factor[0].surfaces"]),
        ('rule = "asce7"\n' + FRICTION + "surfaces = []\ndirect = { t = [1, 1] }\n", ["factor[0].surfaces = []"]),
        ('rule = "asce7"\n' + FRICTION + "surfaces = [9]\ndirect = { t = [1, 1] }\n", ["9", "surfaces 1 to 4"]),
        ('rule = "asce7"\n' + 2 * (FRICTION + "direct = { t = [1, 1] }\n"), ["factor[1]", "already"]),
    ],
)
def test_a_bad_table_is_one_line_and_nothing_is_written(
    text: str, words: list[str], tmp_path: Path, capsys: Any
) -> None:
    path = written(tmp_path, text)
    assert main(["bound", "fenz-test2", "--factors", str(path), "-o", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1
    assert all(word in err for word in words), err
    assert [item.name for item in tmp_path.iterdir()] == ["mine.toml"]


def test_unknown_tables_and_bytes_that_are_no_text(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"did you mean 'asce7'"):
        load_factors("asce")
    (tmp_path / "bytes.toml").write_bytes(b"rule = '\xff'")
    with pytest.raises(InputError, match="no UTF-8 text at byte 8"):
        load_factors(tmp_path / "bytes.toml")


def test_scenes_have_their_properties_multiplied(tmp_path: Path) -> None:
    text = (
        'rule = "asce7"\n[[factor]]\nproperty = "friction"\nsurfaces = [1, 4]\ndirect = { t = [0.5, 2] }\n'
        '[[factor]]\nproperty = "friction"\nsurfaces = [2]\ndirect = { t = [0.8, 1.5] }\n'
        '[[factor]]\nproperty = "rim_stiffness"\ndirect = { t = [0.9, 1.1] }\n'
    )
    scene = load_scene("fenz-test2")
    scenes = bounded_scenes(scene, load_factors(written(tmp_path, text)))
    assert list(scenes) == ["lower", "nominal", "upper"] and scenes["nominal"] is scene
    given = np.array([surface.friction for surface in scene.bearing.surfaces])
    for case, factors, rim in (("lower", (0.5, 0.8, 1, 0.5), 0.9), ("upper", (2, 1.5, 1, 2), 1.1)):
        surfaces = scenes[case].bearing.surfaces
        assert [s.friction for s in surfaces] == pytest.approx(given * factors)
        assert [s.rim_stiffness for s in surfaces] == pytest.approx([1e7 * rim] * 4)
        assert [s.radius for s in surfaces] == [s.radius for s in scene.bearing.surfaces]
        assert scenes[case].name == f"fenz-test2, {case}"


def test_a_second_coefficient_of_friction_goes_with_the_first() -> None:
    """Where every surface has it: a law that takes none leaves it out."""
    bearing = presets.bearing("double-fp").replace(friction=[0.1, 0.2], friction_slow=[0.04, 0.08])
    scaled = _scaled(bearing, "friction_slow", (0.5, 2.0))
    assert [surface.friction_slow for surface in scaled.surfaces] == [0.02, 0.16]
    first, second = bearing.surfaces
    one = dataclasses.replace(bearing, surfaces=[first, dataclasses.replace(second, friction_slow=None)])
    assert _scaled(one, "friction_slow", (0.1, 0.1)) is one


@cache
def single() -> Bounds:
    """A single pendulum under a free plate, pushed slowly, at the bounds of ASCE 7."""
    top = Body(height=0.02, centroid=0.01, mass=0.1, inertia=(1e-4, 1e-4), rim_radius=0.05)
    surface = Surface(radius=0.5, capacity=0.3, friction=0.05, yield_displacement=1e-5, rim_stiffness=1e7)
    bearing = Bearing(layout=Layout(2, 1, 0), base_height=0.01, surfaces=[surface], bodies=[top])
    scene = Scene(
        bearing,
        Motion.harmonic(0.1, 0.01, cycles=1.0),
        Top.rig(axial_load=1e5, stiffness=1e10),
        Effects(dimension="planar", sliders="massless"),
        Solver(rtol=1e-6),
        output_step=0.05,
    )
    return bound(scene, load_factors("asce7"))


def test_bounds_of_a_single_pendulum_in_closed_form() -> None:
    """Q = N tan b, sin b = mu R/sqrt(1 + mu^2)/L, for each case; forces follow the upper, damping too."""
    found = single()
    assert found.succeeded and found.lambdas["friction"]["nominal"] == (1.0,)
    numbers = found.quantities()
    for case, factor in zip(("lower", "nominal", "upper"), (ASCE[0], 1.0, ASCE[1]), strict=True):
        mu = 0.05 * factor
        circle = np.arcsin(mu * 0.5 / np.hypot(1, mu) / 0.48)
        assert numbers["zero_displacement_force"][case] == pytest.approx(1e5 * np.tan(circle), rel=2e-3)
        force = 1e5 * np.tan(np.arcsin(0.1 / 0.48) + circle)
        assert numbers["peak_force"][case] == pytest.approx(force, rel=2e-3)
    assert found.governing()["peak_force"] == "upper" and found.governing()["peak_heat_flux_1"] == "upper"
    damping = numbers["effective_damping"]
    assert damping["lower"] < damping["nominal"] < damping["upper"]  # type: ignore[operator]
    assert "effective_damping" not in found.governing()  # neither end of it is the worse


def test_the_nominal_case_is_the_scene_itself() -> None:
    nominal = single().cases[1]
    assert nominal.name == "nominal" and nominal.result is not None and nominal.characterisation is not None
    assert nominal.characterisation.as_dict() == nominal.result.characterise().as_dict()
    assert nominal.scene.bearing.surfaces[0].friction == 0.05


def test_json_holds_every_case_and_no_nan() -> None:
    table = json.loads(json.dumps(single().as_dict(), allow_nan=False))
    assert list(table["cases"]) == ["lower", "nominal", "upper"]
    assert table["factors"]["lambdas"]["friction"]["upper"] == pytest.approx([ASCE[1]])
    assert table["cases"]["upper"]["characterisation"]["cycles"][0]["number"] == 1


def test_figure_overlays_the_three_loops(tmp_path: Path) -> None:
    figure = plot_bounds(single(), tmp_path / "bounds.png")
    (axes,) = figure.axes
    assert len({line.get_color() for line in axes.get_lines()}) == 3
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["lower: friction × 0.595", "nominal: friction × 1", "upper: friction × 2.12"]
    assert (tmp_path / "bounds.png").stat().st_size > 10_000


@pytest.fixture
def upper_fails(monkeypatch: Any) -> None:
    def run_to_end(scene: Scene, **_: Any) -> Any:
        run = dataclasses.replace(loops(), scene=scene)
        if scene.name.endswith("upper") and "ccc" not in scene.motion.name:
            return dataclasses.replace(run, status="newton", message="stopped at t = 3 s: jammed")
        return run

    for module in ("batch", "run"):
        monkeypatch.setattr(f"msfp_gen.studies.{module}.run_to_end", run_to_end)
        monkeypatch.setattr(f"msfp_gen.studies.{module}.build_models", lambda _: None)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)


def test_a_bound_that_fails_leaves_the_others(upper_fails: None, tmp_path: Path, capsys: Any) -> None:
    folder = tmp_path / "out"
    assert main(["bound", "fenz-test5", "-o", str(folder)]) == 1
    out, err = capsys.readouterr()
    assert "runs that failed" in out and "jammed" in out
    assert err.splitlines()[-1] == "error: not all cases could be run; upper: stopped at t = 3 s: jammed"
    assert sorted(path.name for path in folder.iterdir()) == [
        "bounds.csv",
        "bounds.png",
        "lower.nc",
        "nominal.nc",
        "upper.nc",
    ]
    rows = {row["quantity"]: row for row in csv.DictReader((folder / "bounds.csv").read_text("utf-8").splitlines())}
    assert rows["peak_force [N]"]["upper"] == "" and float(rows["peak_force [N]"]["lower"]) > 0
    assert rows["peak_force [N]"]["governs"] == ""  # nothing governs what was not compared


def test_a_bound_that_fails_before_its_first_row_leaves_the_others(
    monkeypatch: Any, upper_fails: None, tmp_path: Path, capsys: Any
) -> None:
    def run_to_end(scene: Scene, **_: Any) -> Any:
        if scene.name.endswith("upper"):
            raise RunError("stopped at t = 0 s: jammed", status="newton")
        return dataclasses.replace(loops(), scene=scene)

    monkeypatch.setattr("msfp_gen.studies.batch.run_to_end", run_to_end)
    folder = tmp_path / "out"
    assert main(["bound", "fenz-test5", "-o", str(folder)]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error == "error: not all cases could be run; upper: stopped at t = 0 s: jammed"
    assert sorted(path.name for path in folder.iterdir()) == ["bounds.csv", "bounds.png", "lower.nc", "nominal.nc"]

    monkeypatch.setattr("msfp_gen.studies.bounding.runs.CASES", ("upper",))
    with pytest.raises(RunError, match="upper: stopped at t = 0 s"):
        bound(load_scene("fenz-test5"), load_factors("asce7"))


def test_an_interruption_stops_all_runs(monkeypatch: Any) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("msfp_gen.studies.workers.SimpleQueue", lambda: Mock(get=interrupted))
    with pytest.raises(KeyboardInterrupt):
        bound(load_scene("fenz-test2"), load_factors("asce7"))


def test_command_on_a_test_of_the_report(tmp_path: Path, capsys: Any) -> None:
    folder = tmp_path / "new" / "bounds"
    folder.parent.mkdir()
    assert main(["bound", "fenz-test2", "--factors", "asce7-quality", "-o", str(folder)]) == 0
    out, err = capsys.readouterr()
    for words in ("asce7-quality", "not compared with the standard", "zero displacement force [kN]", "governs"):
        assert words in out
    assert [line.split("/")[-1] for line in err.splitlines() if line.startswith("wrote")] == [
        "lower.nc",
        "nominal.nc",
        "upper.nc",
        "bounds.csv",
        "bounds.png",
    ]
    assert main(["bound", "fenz-test2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    stiffness = found["quantities"]["effective_stiffness"]
    assert stiffness["lower"] < stiffness["nominal"] < stiffness["upper"]
    assert found["governing"]["peak_force"] == "upper"
    why = "lower, nominal, upper: the run ends while the bearing still moves: give motion.hold"
    assert found["undefined"]["residual_displacement"].startswith(why)
    assert "what is not defined, and why" in out and why in (folder / "bounds.csv").read_text()


@pytest.mark.slow
def test_all_cases_have_the_same_effects() -> None:
    """Auto leaves inertia out at the upper bound of friction only; then all three runs have it."""
    scene = load_scene("fenz-test2")
    scene = dataclasses.replace(scene, effects=Auto(), top=dataclasses.replace(scene.top, damping=200.0))
    chosen = {name: each.modelled.sliders for name, each in bounded_scenes(scene, load_factors("asce7")).items()}
    assert chosen == {"lower": "inertial", "nominal": "inertial", "upper": "massless"}
    found = bound(scene, load_factors("asce7"))
    models = {case.result.provenance["model"].split(", then ")[-1] for case in found.cases if case.result}
    assert len(models) == 1 and "inertial" in models.pop()
    assert found.lambdas["friction"]["upper"][0] > 1 > found.lambdas["friction"]["lower"][0]


SUITE = """
[[records]]
bundled = "ridgecrest-2019-ci-clc"
duration = 6.0

[[records]]
bundled = "ridgecrest-2019-ci-ccc"
duration = 6.0
"""


def suite_file(folder: Path) -> Path:
    (folder / "suite.toml").write_text(SUITE)
    return folder / "suite.toml"


def test_a_suite_at_bounds_is_that_of_its_records(tmp_path: Path, capsys: Any) -> None:
    """Means, worst values and envelopes by hand from the bounds of each record; one row for each surface."""
    out = tmp_path / "out"
    arguments = ["bound", "ridgecrest-clc", "--suite", str(suite_file(tmp_path)), "--factors", "asce7-quality"]
    assert main([*arguments, "-o", str(out)]) == 0
    printed, said = capsys.readouterr()
    assert "2 records at bounds by asce7-quality" in printed and "what has no mean, and why" in printed
    assert printed.count("the run ends while the bearing still moves") == 1  # not for every surface and case
    assert all(str(out / name) in said for name in ("suite.csv", "records.csv", "suite.png"))
    with (out / "suite.csv").open() as file:
        rows = {row["quantity"]: row for row in csv.DictReader(file)}
    with (out / "records.csv").open() as file:
        runs = list(csv.DictReader(file))
    assert [(run["record"], run["case"]) for run in runs[:4]] == [
        *(("ridgecrest-2019-ci-clc", case) for case in CASES),
        ("ridgecrest-2019-ci-ccc", "lower"),
    ]
    for name, pick in (("peak displacement", max), ("capacity left of surface 2", min)):
        row, by_case = rows[name], {c: [float(r[f"{name} [m]"]) for r in runs if r["case"] == c] for c in CASES}
        means = {case: sum(values) / 2 for case, values in by_case.items()}
        assert all(float(row[f"mean {case}"]) == pytest.approx(mean, rel=1e-14) for case, mean in means.items())
        assert all(float(row[f"worst {case}"]) == pick(values) for case, values in by_case.items())
        assert float(row["envelope of means"]) == pytest.approx(pick(means.values()), rel=1e-14)
        assert float(row["envelope of worst"]) == pick(map(pick, by_case.values()))
        assert row["governs"] == pick(means, key=means.__getitem__)
    assert rows["capacity left of surface 2"]["of"] == "surface 2" and rows["peak displacement"]["of"] == ""
    check_uplift_words(load_suite_bounds(out)[1], rows["least normal force over the load at rest"], printed)


def check_uplift_words(found: SuiteBounds, row: dict[str, str], printed: str) -> None:
    """How far the normal force fell, and in how many runs uplift was simulated; also of runs that simulate it."""
    assert 0 < float(row["envelope of worst"]) < 1  # of runs with the vertical component
    fell = f"{float(row['envelope of worst']):.3g} of the load at rest, under {row['worst record']}"
    (words,) = uplift_words(found)
    assert fell in words and words in printed and words.startswith("No run simulated uplift")
    heights = np.full_like(found.values["maximum_uplift"], np.nan)
    closed = f"No bearing opened in any run: the least normal force of a surface was {fell}."
    opened = f"The bearing opened by at most 4 mm, under {found.records[0]}."
    for height, begins in (([0.0, np.nan], closed), ([4e-3, 1e-3], opened)):
        heights[:, 0] = height
        (words,) = uplift_words(dataclasses.replace(found, values={**found.values, "maximum_uplift": heights}))
        runs = int((~np.isnan(heights)).sum())
        assert words == f"{begins} Uplift was simulated in {runs} of {heights.size} runs."


def test_no_bound_governs_equal_values_and_no_record_is_their_worst() -> None:
    """Where nothing opened, the heights are 0 at all bounds and under all records; the envelopes stay."""
    sources = {name: ColumnSource(RunQuantity("m", name, "most")) for name in ("equal", "differs")}
    values = {"equal": np.zeros((2, 3)), "differs": np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 1.0]])}
    found = SuiteBounds("", "asce7", ("A", "B"), (), sources, values, {}, {}, {})
    equal, differs = found.statistics
    assert (equal.governs, equal.record, equal.envelope) == ("", "", (0.0, 0.0))
    assert (differs.governs, differs.record, differs.envelope) == ("nominal", "B", (1.0, 2.0))
    assert [row[-2:] for row in suite_bound_tables(found)[0].rows] == [("-", "-"), ("nominal", "B")]


def test_a_suite_of_a_building_has_the_names_of_its_bearings() -> None:
    made = load_scene("hospital-clc")
    sources = quantities(made)
    parts = {name: source.part for name, source in sources.items()}
    assert [parts[f"bearing_displacement_{number}"] for number in range(1, 13)] == [
        f"{column}{row}" for row in (1, 2, 3) for column in "ABCD"
    ]
    assert parts["storey_shear_1"] == "storey 1" and parts["floor_acceleration_1"] == "base"
    assert parts["peak_force"] == ""


SCALED = """
[[records]]
bundled = "ridgecrest-2019-ci-clc"
duration = 6.0
scale = 8.0
name = "CLC"

[[records]]
bundled = "ridgecrest-2019-ci-ccc"
duration = 6.0
name = "CCC"
"""


def test_doubtful_values_of_a_suite_are_printed_before_its_runs(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    """One line for each: of one record with its name, of all runs without; not of a record that is left out."""
    (tmp_path / "suite.toml").write_text(SCALED)
    scene = changed_scene("ridgecrest-clc", {"limits": {"displacement": 0.9}})
    (tmp_path / "scene.toml").write_text(scene_text(scene))
    given = ["bound", str(tmp_path / "scene.toml"), "--suite", str(tmp_path / "suite.toml"), "--factors", "asce7"]
    calls = []

    def bound_suite(study: Any, *_: Any, leave_out: Any, **__: Any) -> None:
        calls.append(leave_out)
        raise RunError("enough", status="bound")

    monkeypatch.setattr("msfp_gen.studies.bounding.suite.bound_suite", bound_suite)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)
    assert main(given) == 1 and len(calls) == 1
    said = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("error")]
    assert [line.partition(" = ")[0] for line in said if "limits.displacement" in line] == ["limits.displacement"]
    assert [line.partition(" = ")[0] for line in said if "motion.scale =" in line] == ["CLC: motion.scale"]
    assert len([line for line in said if line.startswith("CLC: motion: the peak acceleration of")]) == 1
    assert main([*given, "--leave-out", "CLC"]) == 1
    assert "CLC" not in capsys.readouterr().err


def test_a_suite_is_refused_for_values_that_no_unit_makes_right(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    """In Python and by the command, before anything is written; not for a record that is left out, nor by force."""
    (tmp_path / "suite.toml").write_text(SCALED.replace("scale = 8.0", "scale = 900.0"))
    made = suite_study("ridgecrest-clc", tmp_path / "suite.toml", "asce7")
    ran: list[Any] = []
    monkeypatch.setattr("msfp_gen.studies.run.run_on", lambda *_, without, **__: ran.append(list(without)))
    monkeypatch.setattr("msfp_gen.studies.bounding.suite._from_rows", lambda *_: None)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)
    with pytest.raises(InputError, match=r"motion.scale = 900 changes .* force=True"):
        bound_suite(made, tmp_path / "out")
    given = ["bound", "ridgecrest-clc", "--suite", str(tmp_path / "suite.toml"), "-o", str(tmp_path / "out")]
    assert main([*given, "--factors", "asce7"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "motion.scale = 900" in error and "--force" in error
    assert not ran and not (tmp_path / "out").exists()
    bound_suite(made, leave_out=["CLC"])
    bound_suite(made, force=True)
    assert ran == [[0, 1, 2], []]


def test_doubtful_values_of_bounds_are_printed(capsys: Any, monkeypatch: Any, tmp_path: Path) -> None:
    """Friction that is usual as given, and not at upper bound; gravity, which is the same in every case."""
    changes = {"bearing.surfaces[0].friction": 0.25, "bearing.gravity": 8.0}
    path = tmp_path / "scene.toml"
    path.write_text(scene_text(changed_scene("fenz-test2", changes)))
    monkeypatch.setattr("msfp_gen.studies.bounding.runs.bound", Mock(side_effect=RunError("enough", status="bound")))
    assert main(["bound", str(path), "--factors", "asce7"]) == 1
    said = capsys.readouterr().err.splitlines()
    assert [line.partition(" = ")[0] for line in said[:-1]] == [
        "bearing.gravity",
        "upper: bearing.surfaces[0].friction",
    ]


def statistics(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "suite.csv").open() as file:
        return {row["quantity"]: row for row in csv.DictReader(file)}


def test_a_suite_with_a_failed_run_has_means_of_the_others(upper_fails: None, tmp_path: Path, capsys: Any) -> None:
    """Means of complete bounds stay; the bound with a failed run says of which records its mean is."""
    out = tmp_path / "out"
    given = ["bound", "ridgecrest-clc", "--suite", str(suite_file(tmp_path)), "--factors", "asce7-quality"]
    assert main([*given, "-o", str(out)]) == 1
    printed, error = capsys.readouterr()
    assert "* mean upper  of the 1 that ended, ridgecrest-2019-ci-clc left out" in printed and "* mean l" not in printed
    assert "error: 1 run did not reach its end: ridgecrest-2019-ci-clc, upper: " in error
    assert error.endswith("--leave-out ridgecrest-2019-ci-clc\n")
    row = statistics(out)["peak displacement"]
    assert [row[f"records in mean {case}"] for case in CASES] == ["2", "2", "1"]
    assert row["governs"] == row["envelope of means"] == "" and float(row["envelope of worst"]) > 0
    assert all(float(row[f"{what} {case}"]) > 0 for what in ("mean", "worst") for case in CASES)
    assert (out / "records.csv").read_text().count("jammed") == 1 and (out / "suite.png").is_file()

    assert main([*given, "-o", str(out), "--leave-out", "ridgecrest-2019-ci-clc", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["left_out"] == ["ridgecrest-2019-ci-clc"] and found["records"] == ["ridgecrest-2019-ci-ccc"]
    row = statistics(out)["peak displacement"]
    assert float(row["envelope of means"]) > 0 and found["means"] == {}
    assert row["governs"] == ""  # the three runs are one


def test_a_suite_that_was_interrupted_continues(monkeypatch: Any, tmp_path: Path, capsys: Any) -> None:
    """Every run that had ended is kept; the same command runs the others, and a third time none."""
    out = tmp_path / "out"
    given = ["bound", "ridgecrest-clc", "--suite", str(suite_file(tmp_path)), "--factors", "asce7-quality"]
    given += ["--workers", "1", "-o", str(out)]
    runs: list[str] = []

    def run_to_end(scene: Scene, **_: Any) -> Any:
        if len(runs) == 4:
            raise KeyboardInterrupt
        runs.append(scene.name)
        return dataclasses.replace(loops(), scene=scene)

    monkeypatch.setattr("msfp_gen.studies.run.run_to_end", run_to_end)
    monkeypatch.setattr("msfp_gen.studies.run.build_models", lambda _: None)
    monkeypatch.setattr("msfp_gen.model.model.build_model", lambda *_, **__: None)
    assert main(given) == 130
    assert f"what is done is kept in {out}; the same command continues" in capsys.readouterr().err
    kept = len(list(out.glob("part-*")))
    assert kept in (3, 4) and not (out / "suite.csv").exists()  # the fourth may not have been written yet
    runs.clear()  # here, since the worker may have begun another run before it was told to end
    assert main(given) == 0 and len(runs) == 6 - kept
    numbers = (out / "suite.csv").read_text()
    assert main(given) == 0 and len(runs) == 6 - kept and (out / "suite.csv").read_text() == numbers
    assert main([*given[:5], "asce7", *given[6:]]) == 2
    assert "parts of another study (axes differs)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--suite", "{suite}", "--leave-out", "ridgecrest-clc"], "--leave-out = 'ridgecrest-clc': no record"),
        (
            ["--suite", "{suite}", "--leave-out", "ridgecrest-2019-ci-clc", "--leave-out", "ridgecrest-2019-ci-ccc"],
            "is left",
        ),
        (["--leave-out", "ridgecrest-2019-ci-clc"], "--leave-out: it is for the runs of a suite; give --suite"),
        (["--workers", "2"], "--workers: it is for the runs of a suite; give --suite"),
    ],
)
def test_records_left_out_are_those_of_the_suite(options: list[str], words: str, tmp_path: Path, capsys: Any) -> None:
    given = [option.format(suite=suite_file(tmp_path)) for option in options]
    assert main(["bound", "ridgecrest-clc", *given, "-o", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize("processes", [True, False])
def test_a_study_at_the_bounds_of_a_sheet_runs_them_in_every_worker(
    processes: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A worker process has a copy of the table `sheet`, which must mean the same there."""
    monkeypatch.setattr(Workers, "in_process", lambda *_: processes)
    table = toml_table(scene_text(load_scene("fenz-test2")))
    friction = [surface["friction"] for surface in table["bearing"]["surfaces"]]
    table["bearing"] |= {
        f"friction_{bound}": [mu * by for mu in friction] for bound, by in (("lower", 0.5), ("upper", 1.5))
    }
    definition = {"scene": table, "axes": {"bounds": {"factors": "sheet"}}, "keep": ["peak_force"]}
    study(definition, tmp_path, workers=2)
    forces = read_study(tmp_path)["peak_force"].tolist()
    assert forces[0] < forces[1] < forces[2]


def test_factors_act_at_the_pivot_where_the_scene_gives_friction_there() -> None:
    """A factor of the inner surfaces alone changes the moment that they give to the outer ones."""
    table = _read("inner", {
        "rule": "asce7", "factor": [{"property": "friction", "surfaces": [2, 3], "direct": {"test": [0.5, 2.0]}}],
    })  # fmt: skip
    given = [0.05, 0.02, 0.03, 0.09]
    scene = load_scene("fenz-test1")
    at_pivot = dataclasses.replace(scene, bearing=scene.bearing.replace(friction=given, friction_at="pivot"))
    wanted = scene.bearing.replace(friction=[0.05, 0.04, 0.06, 0.09], friction_at="pivot")
    found = bounded_scene(at_pivot, table, "upper").bearing
    assert [s.friction for s in found.surfaces] == pytest.approx([s.friction for s in wanted.surfaces], rel=1e-12)
    assert found.friction_at_pivot == pytest.approx([0.05, 0.04, 0.06, 0.09], rel=1e-12)
    at_surface = dataclasses.replace(scene, bearing=scene.bearing.replace(friction=given))
    found = bounded_scene(at_surface, table, "upper").bearing
    assert [s.friction for s in found.surfaces] == pytest.approx([0.05, 0.04, 0.06, 0.09], rel=1e-12)
    moved = at_pivot.bearing.replace(gravity=9.81)
    assert moved.friction_given_at == "pivot" and moved.replace(friction=given).friction_given_at == "surface"
    lambdas = next(t for t in bounding_tables(bound(at_pivot, table)) if "lambda of every" in t.title)
    assert lambdas.rows[1] == ("friction at the pivot 2", "0.5", "1", "2", "0.01", "0.02", "0.04")
    assert lambdas.rows[0][-1] == "0.05"


def test_a_factor_at_the_pivot_multiplies_a_law_as_a_whole() -> None:
    table = _read("inner", {
        "rule": "asce7", "factor": [{"property": "friction", "surfaces": [2, 3], "direct": {"test": [0.5, 2.0]}}],
    })  # fmt: skip
    scene = load_scene("fenz-test1")
    law = {"friction_slow": [0.02, 0.01, 0.01, 0.04], "velocity_rate": 20.0}
    bearing = scene.bearing.replace(friction=[0.05, 0.02, 0.03, 0.09], friction_at="pivot").replace(**law)
    scene = dataclasses.replace(scene, bearing=bearing, effects=Auto())
    found = bounded_scene(scene, table, "upper").bearing
    for new, old in zip(found.surfaces, bearing.surfaces, strict=True):
        assert new.friction_slow / old.friction_slow == pytest.approx(new.friction / old.friction, rel=1e-12)
    assert found.surfaces[0].friction > 1.01 * bearing.surfaces[0].friction


def test_a_run_that_met_its_stop_condition_is_in_no_mean(tmp_path: Path, capsys: Any) -> None:
    """Its values are those until then: all runs of this suite would have one displacement, that of the condition."""
    scene = changed_scene("ridgecrest-clc", {"stop": {"displacement": 5e-3}})
    path = tmp_path / "scene.toml"
    path.write_text(scene_text(scene))
    out = tmp_path / "out"
    suite = suite_file(tmp_path)
    assert main(["bound", str(path), "--suite", str(suite), "--factors", "asce7-quality", "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "of the 0 that ended, ridgecrest-2019-ci-clc, ridgecrest-2019-ci-ccc left out" in printed
    row = statistics(out)["peak displacement"]
    assert row["mean lower"] == row["governs"] == "" and float(row["worst lower"]) == pytest.approx(5e-3, rel=1e-3)
    with (out / "records.csv").open() as file:
        assert all(0 < float(run["stopped at [s]"]) < 6.0 for run in csv.DictReader(file))
    case = bound(scene, load_factors("asce7-quality")).cases[0]
    assert case.result is not None and case.stopped_at == case.result.summary["duration"]
    assert case.verdict.startswith(f"the run met its stop condition at {case.stopped_at:.4g} s; until then ")


def test_records_of_a_suite_have_different_colours() -> None:
    assert distinct_colours(4) == list(COLOURS[:4])
    assert all(len(set(distinct_colours(count))) == count for count in (7, 11, 22, 44))
