"""The definition of a study: axes, distributions, sampling, quantities, and what a file may not say."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy import stats
from support import ROOT
from support.study_tables import cheap_study, rows_of

import msfp_gen
from msfp_gen import InputError, changed_scene, load_scene, simulate
from msfp_gen.motions.records import response_spectrum
from msfp_gen.motions.records.spectrum import MEASURES
from msfp_gen.results.quantities import BEARING, ColumnSource, sources_of
from msfp_gen.scene.file.loader import scene_from_table, toml_file
from msfp_gen.scene.file.motion_tables import RecordMotion
from msfp_gen.studies import load_study
from msfp_gen.studies.axes import METHODS, Distribution, Sampling
from msfp_gen.studies.columns import Keep
from msfp_gen.studies.definition import example_text


def values_of(study: Any, run: int) -> tuple[Any, ...]:
    number, row = divmod(run - 1, study.chunk)
    return study.task(number).rows(study.axes)[row][0]


def test_a_scene_of_a_study_is_the_base_scene_with_the_values_of_its_run() -> None:
    study = load_study(cheap_study())
    assert (study.runs, study.chunks, study.shape) == (12, 3, (2, 6))
    base = load_scene("fenz-test1")
    for run in (1, 7, 12):
        rtol, factor = values_of(study, run)
        scene = study.scene(run)
        assert scene.solver.rtol == rtol == (1e-2 if run <= 6 else 5e-3)
        for was, now in zip(base.bearing.surfaces, scene.bearing.surfaces, strict=True):
            assert now.friction == was.friction * factor
        assert scene.motion == base.motion and scene.name == f"cheap, run {run}"
    with pytest.raises(InputError, match="run = 13: give a number from 1 to 12"):
        study.scene(13)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("bearing.friction", [0.05, 0.02, 0.02, 0.09]),
        ("bearing.friction", 0.06),
        ("bearing.base_height", "30 mm"),
        ("top.axial_load", "150 kN"),
        ("solver.method", "dopri5"),
        ("motion.amplitude", "2 mm"),
        ("effects.rims", True),
        ("duration", 3.0),
        ("stop.displacement", 0.001),
        ("bearing", "becker-tfp"),
    ],
)
def test_a_field_that_an_axis_sets_is_that_of_a_scene_file(path: str, value: Any) -> None:
    """Some fields are set without reading the table again; the scene must be the same."""
    study = load_study({"scene": "fenz-test1", "axes": {"x": {"sets": path, "values": [value]}}})
    found, expected = study.scene(1), changed_scene("fenz-test1", {path: value})
    assert replace(found, name="", motion_table=None) == replace(expected, name="", motion_table=None)


def test_an_axis_may_change_several_fields_and_some_surfaces() -> None:
    axes = {
        "outer": {"multiplies": "bearing.friction", "surfaces": [1, 4], "values": [2.0]},
        "stiff": {"sets": ["top.stiffness", "top.rotational_stiffness"], "values": ["2 kN/m", "2 MN/m"][:1]},
    }
    with pytest.raises(
        InputError, match=r"run 1 \(outer = 2.0, stiff = '2 kN/m'\): top.rotational_stiffness"
    ):  # one text cannot have both units
        load_study({"scene": "fenz-test1", "axes": axes})
    axes["stiff"]["values"] = [2e6, 3e6]
    scene = load_study({"scene": "fenz-test1", "axes": axes}).scene(2)
    base = load_scene("fenz-test1").bearing.surfaces
    assert [s.friction / b.friction for s, b in zip(scene.bearing.surfaces, base, strict=True)] == [2, 1, 1, 2]
    assert scene.top.stiffness == scene.top.rotational_stiffness == 3e6


def test_records_and_scales_are_axes() -> None:
    motions = [
        {"bundled": "ridgecrest-2019-ci-clc", "duration": 30.0},
        {"bundled": "ridgecrest-2019-ci-ccc", "duration": 30.0},
    ]
    study = load_study({"scene": "ridgecrest-ccc", "records": {"motions": motions, "scales": [0.5, 2]}})
    assert [axis.name for axis in study.axes] == ["record", "scale"] and study.runs == 4
    assert study.axes[0].labels == tuple(study.inputs.records)
    times = np.linspace(0, 30, 50)
    for run, (index, scale) in enumerate([(0, 0.5), (0, 2), (1, 0.5), (1, 2)], start=1):
        scene = study.scene(run)
        table = {**study.inputs.scene, "motion": {"kind": "record", **motions[index], "scale": scale}}
        expected = scene_from_table(table).motion
        assert expected is not None
        for time in times:
            np.testing.assert_allclose(
                scene.motion.acceleration(time), expected.acceleration(time), rtol=1e-12, atol=1e-12
            )
        assert scene.motion_table is not None and scene.motion_table["scale"] == scale


def test_the_intensity_measure_is_that_of_the_spectrum(tmp_path: Any) -> None:
    motions = [{"bundled": "ridgecrest-2019-ci-clc", "duration": 30.0, "name": "clc"}]
    records = {"motions": motions, "scales": [0.1, 0.2], "intensity": {"period": 2.0, "component": "rotd100"}}
    table = {"scene": "ridgecrest-ccc", "records": records, "quantities": {"twice": "2 * intensity"}}
    study = load_study({**table, "axes": {"end": {"sets": "duration", "values": [0.1]}}})
    spectrum = response_spectrum(RecordMotion(**motions[0]).build(), [2.0])
    expected = spectrum.psa[0, MEASURES.index("rotd100")]
    assert study.inputs.intensities == {"clc": pytest.approx(expected)}
    msfp_gen.study(study, tmp_path)
    rows = rows_of(tmp_path)
    np.testing.assert_allclose(rows.intensity, [0.1 * expected, 0.2 * expected])
    np.testing.assert_allclose(rows.twice, 2 * rows.intensity)
    del records["intensity"]["period"]
    assert load_study(table).inputs.intensities["clc"] == pytest.approx(spectrum.pga[MEASURES.index("rotd100")])
    with pytest.raises(InputError, match=r"records.intensity.component = 'rotd10': give one of"):
        load_study({**table, "records": {**records, "intensity": {"component": "rotd10"}}})


@pytest.mark.parametrize("name", ["record", "scale"])
def test_an_axis_beside_records_has_no_name_of_theirs(name: str) -> None:
    """Without `scales` too: an axis `scale` that changes something else would multiply the intensity."""
    records = {"motions": [{"bundled": "ridgecrest-2019-ci-clc", "duration": 30.0}], "intensity": {"period": 1.0}}
    axes = {name: {"multiplies": "bearing.friction", "values": [0.5, 1.0]}}
    with pytest.raises(InputError, match=rf"axes.{name}: \[records\] makes the axes record and scale"):
        load_study({"scene": "ridgecrest-ccc", "records": records, "axes": axes})


def test_a_name_in_a_formula_is_that_of_an_axis_or_of_a_quantity() -> None:
    """Where it was both, the formula took the axis: here the factor on the load for the force."""
    axes = {"peak_force": {"multiplies": "top.axial_load", "values": [0.5, 1.0]}}
    study = {"scene": "fenz-test1", "axes": axes, "keep": ["peak_displacement"]}
    assert load_study(study).runs == 2
    with pytest.raises(InputError, match=r"quantities.x = '2 \* peak_force': peak_force is a quantity and an axis"):
        load_study({**study, "quantities": {"x": "2 * peak_force"}})


def test_factors_are_an_axis_of_bounds() -> None:
    study = load_study({"scene": "fenz-test1", "axes": {"bounds": {"factors": "asce7"}}})
    base, found = load_scene("fenz-test1").bearing, [study.scene(run).bearing for run in (1, 2, 3)]
    assert study.axes[0].labels == ("lower", "nominal", "upper") and found[1] == base
    assert found[0].surfaces[0].friction == pytest.approx(0.595 * base.surfaces[0].friction)
    assert found[2].surfaces[3].friction == pytest.approx(2.12290 * base.surfaces[3].friction, rel=1e-4)


REFERENCES: dict[str, tuple[tuple[float, ...], Any]] = {
    "uniform": ((2.0, 5.0), stats.uniform(2, 3)),
    "triangular": ((1.0, 2.0, 4.0), stats.triang(1 / 3, 1, 3)),
    "normal": ((3.0, 0.5), stats.norm(3, 0.5)),
    "lognormal": ((3.0, 0.5), stats.lognorm(0.5, scale=3)),
}


@pytest.mark.parametrize("kind", REFERENCES)
def test_distributions_are_those_of_scipy(kind: str) -> None:
    parameters, reference = REFERENCES[kind]
    shares = np.linspace(0.01, 0.99, 25)
    found = Distribution(kind, parameters)
    np.testing.assert_allclose(found.values(shares), reference.ppf(shares), rtol=1e-12)
    np.testing.assert_allclose([found.share(x) for x in found.values(shares)], shares, rtol=1e-12)
    low, high = reference.ppf([0.2, 0.7])
    cut = Distribution(kind, parameters, (low, high))
    np.testing.assert_allclose(cut.values(shares), reference.ppf(0.2 + 0.5 * shares), rtol=1e-12)


def test_a_latin_hypercube_has_one_value_in_each_interval_and_a_seed() -> None:
    plan = Sampling("latin-hypercube", 40, seed=7)
    shares = plan.shares(3)
    for column in shares.T:
        assert sorted(np.floor(40 * column).astype(int)) == list(range(40))
    np.testing.assert_array_equal(shares, Sampling("latin-hypercube", 40, seed=7).shares(3))
    assert not np.array_equal(shares, Sampling("latin-hypercube", 40, seed=8).shares(3))


@pytest.mark.parametrize("method", METHODS)
def test_every_sampling_has_its_number_of_rows(method: str) -> None:
    if method == "listed":
        values = ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
        axes = [Distribution("uniform", (0.0, 9.0))] * 3
        assert Sampling(method, values=values).drawn(axes).tolist() == [list(row) for row in values]
        with pytest.raises(InputError, match=r"sampling.values: give 2 values in each row"):
            Sampling(method, values=values).drawn(axes[:2])
        with pytest.raises(InputError, match=r"sampling.values: give one row for each sample"):
            Sampling("random", 8, values=values)
        return
    plan = Sampling(method, None if method == "one-at-a-time" else 8, seed=1)
    expected = {"one-at-a-time": 1 + 2 * 3}.get(method, 8)
    shares = plan.shares(3)
    assert shares.shape == (expected, 3) and ((shares > 0) & (shares < 1)).all()


def test_quantities_are_those_of_the_summary_the_characterisation_and_formulas() -> None:
    text = {
        "ratio": "peak_force / 112e3 * friction",
        "least_force": "least(normal_force_1)",
        "end": "last(displacement_E1)",
        "lost": "last(energy_friction_dissipated)",
    }
    keep = ["peak_force", "peak_sliding", "minimum_gap_2", "effective_damping", "rims_met", "capacity_used"]
    study = load_study(cheap_study(keep=keep, quantities=text, scene="fenz-test2"))
    result = simulate(study.scene(1))
    found, problem = study.keep.values(result, {"friction": 2.0})
    summary, cycles = result.summary, result.characterise()
    assert not problem and found["peak_force"] == summary["peak_force"]["radial"]
    assert [found[f"peak_sliding_{k}"] for k in (1, 2, 3, 4)] == list(summary["peak_sliding"])
    assert found["minimum_gap_2"] == summary["minimum_gap"][1] and found["rims_met"] == ""
    assert found["effective_damping"] == cycles.envelope["effective_damping"].mean
    assert found["ratio"] == pytest.approx(found["peak_force"] / 112e3 * 2.0)
    assert found["least_force"] == result.history.normal_force[:, 0].min()
    assert found["end"] == result.history.displacement[-1, 0]
    assert found["lost"] == result.history.energy["friction_dissipated"][-1] > 0
    capacity = result.scene.bearing.surfaces[3].capacity
    assert found["capacity_used_4"] == 1 - summary["minimum_gap"][3] / capacity
    assert [column.unit for column in study.keep.columns][:2] == ["N", "m"]


def test_extremes_of_formulas_are_over_all_steps_where_a_run_records_them() -> None:
    """With few rows; an extreme that no run records is that of the rows."""
    text = {
        "least_force": "least(normal_force_1)",
        "force": "peak(top_force_E1)",
        "far": "most(sliding_4)",
        "tilt": "peak(tilt_2_psi)",
    }
    study = load_study(cheap_study(quantities=text, axes={}, sampling=None, keep=["minimum_normal_force_1"]))
    few = simulate(replace(study.scene(1), output_step=2.0))
    found, _ = study.keep.values(few, {})
    assert found["least_force"] == found["minimum_normal_force_1"] < few.history.normal_force[:, 0].min()
    assert found["force"] == few.summary["peak_force"]["E1"] > abs(few.history.top_force[:, 0]).max()
    assert found["far"] == few.summary["peak_sliding"][3] >= few.history.sliding[:, 3].max()
    assert found["tilt"] == abs(few.history.tilt_angles[:, 0, 0]).max()


def of_surfaces(count: int) -> tuple[tuple[str, ColumnSource], ...]:
    """The quantities of a bearing with so many surfaces."""
    return tuple(sources_of(BEARING, {}, count).items())


def test_what_a_run_does_not_have_is_none() -> None:
    keep = Keep(("peak_sliding", "peak_temperature"), (("one", "1 / (peak_sliding_1 * 0)"),), (), of_surfaces(6))
    found, _ = keep.values(simulate(load_scene("fenz-test1")), {})
    assert found["peak_sliding_4"] is not None and found["peak_sliding_5"] is None
    assert found["peak_temperature_1"] is None and found["one"] is None


def test_chunks_are_of_a_size_that_suits_the_number_of_runs() -> None:
    sizes = [load_study(cheap_study(chunk=None, sampling={"samples": n})).chunk for n in (6, 512, 4096, 100_000)]
    assert sizes == [8, 16, 128, 256] and all(a <= b for a, b in pairwise(sizes))


def test_the_example_is_a_study_of_a_few_hundred_runs(tmp_path: Any) -> None:
    path = tmp_path / "study.toml"
    path.write_text(example_text(), encoding="utf-8")
    study = load_study(path)
    assert 200 <= study.runs <= 500 and study.limits.run_seconds == 60
    assert toml_file(path)["name"] == study.name


def test_a_file_is_named_in_its_errors(tmp_path: Any) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("scene = 'fenz-test1'\nkeep = ['x']\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"^{path}: keep: 'x' is no quantity"):
        load_study(path)
    with pytest.raises(InputError, match=r"no such file; `msfp-gen study --example`"):
        load_study(tmp_path / "none.toml")
    assert (ROOT / "msfp_gen/studies/example.toml").is_file()


def test_a_residual_displacement_without_rest_has_its_reason() -> None:
    keep = Keep(("residual_displacement",), (), (), of_surfaces(4))
    kept, problem = keep.values(simulate(load_scene("fenz-test1")), {})
    assert kept == {"residual_displacement": None}
    assert problem.startswith("no residual_displacement: the run ends while the bearing still moves: give motion.hold")
    held = simulate(changed_scene("fenz-test1", {"motion.hold": 20.0}))
    kept, problem = keep.values(held, {})
    assert kept["residual_displacement"] > 0.0 and not problem
