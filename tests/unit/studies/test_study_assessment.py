"""Evaluation of studies: fractiles, fragility and its bands, tornado, figures and commands."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import minimize
from scipy.stats import binom, norm
from support.study_tables import cheap_study

import msfp_gen
from msfp_gen import InputError
from msfp_gen.cli import main
from msfp_gen.studies import fragility, ida, load_study, plot_ida, read_study, tornado
from msfp_gen.studies.assessment.fragility import fragility_frame
from msfp_gen.studies.assessment.rows import chosen_rows, side_of

LEVELS = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0])


def rows_like(**columns: Any) -> pd.DataFrame:
    """Rows as `read_study` gives them."""
    count = len(next(iter(columns.values())))
    axes = {name: columns[name] for name in columns if name in ("record", "scale")}
    kept = {name: columns[name] for name in columns if name in ("intensity", "demand")}
    table = {"run": range(1, count + 1), **axes, "status": columns.get("status", "ok"), "message": "", **kept}
    frame = pd.DataFrame(table)
    frame.attrs["units"] = {"demand": "m"}
    return frame


def lognormal_rows(median: float, dispersion: float, count: int, seed: int) -> pd.DataFrame:
    """Demand over capacity, where the capacity is lognormal: the fragility of threshold 1 is exactly that."""
    rng = np.random.default_rng(seed)
    x = np.tile(LEVELS, count)
    return rows_like(scale=x, demand=x / (median * np.exp(dispersion * rng.standard_normal(len(x)))))


def test_fractiles_are_order_statistics_and_early_ends_lie_above_all() -> None:
    values = {1.0: [5, 1, 4, 2, 3, 6, 7, 8, 9, 10], 2.0: [50, 10, 40, 20, 30, 60, 70, 80, 90, 100]}
    rows = rows_like(
        record=[f"r{k}" for _ in values for k in range(10)],
        scale=[scale for scale, found in values.items() for _ in found],
        demand=[float(v) for found in values.values() for v in found],
        status=["ok"] * 10 + ["ok"] * 8 + ["stopped", "uplift"],
    )
    found = ida(rows, "scale", "demand")
    assert list(found.fractiles.scale) == [1, 2]
    assert list(found.fractiles["p16"]) == [2, 20] and list(found.fractiles["p50"]) == [
        5.5,
        55,
    ]  # of ten the mean of the middle two
    assert found.fractiles["p84"][0] == 9 and np.isinf(found.fractiles["p84"][1])
    assert list(found.fractiles["ended_early"]) == [0, 2] and found.unit == "m"
    assert found.curves.groupby("curve").size().tolist() == [2] * 10
    first = found.curves[found.curves.curve == 1]
    assert list(first.scale) == [1, 2] and list(first.demand) == [5, 50]


def test_curves_of_different_intensities_are_interpolated() -> None:
    """Two lines from zero, and one that ends early: known in closed form."""
    rows = rows_like(
        record=["a"] * 3 + ["b"] * 3 + ["c"] * 3,
        scale=[1.0, 2.0, 3.0] * 3,
        intensity=[1.0, 2.0, 3.0, 1.5, 3.0, 4.5, 0.9, 1.8, 2.7],
        demand=[1.0, 2.0, 3.0, 3.0, 6.0, 9.0, 0.45, 0.9, 1.0],
        status=["ok"] * 8 + ["stopped"],
    )
    found = ida(rows, "intensity", "demand").fractiles
    levels = found.intensity.to_numpy()
    assert len(levels) == 50 and levels[-1] == 3.0  # where the first complete curve ends
    slopes = np.where(levels <= 1.8, 0.5, np.inf)
    expected = np.sort(np.stack([levels, 2 * levels, slopes * levels]), axis=0)
    np.testing.assert_allclose(found[["p16", "p50", "p84"]].to_numpy().T, expected, rtol=1e-12)
    assert list(found.ended_early) == [int(level > 1.8) for level in levels]


def test_the_likelihood_is_that_of_baker() -> None:
    """Compared with a direct maximisation of the binomial likelihood over median and dispersion."""
    rows = lognormal_rows(1.1, 0.4, 40, seed=5)
    state = fragility(rows, "scale", "demand", [1.0]).states[0]
    over = np.array([(rows.demand[rows.scale == level] >= 1).sum() for level in LEVELS])

    def negative(x: Any) -> float:
        return -binom.logpmf(over, 40, norm.cdf(np.log(LEVELS / np.exp(x[0])) / np.exp(x[1]))).sum()

    best = minimize(
        negative, [0.0, -1.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 9999}
    )
    np.testing.assert_allclose([state.median, state.dispersion], np.exp(best.x), rtol=1e-6)
    np.testing.assert_array_equal(state.exceeded_at, over)
    assert state.runs == 240 and state.exceeded == over.sum() and state.left_out == 0
    np.testing.assert_allclose(state.probability(np.array([state.median])), 0.5, rtol=1e-12)


def test_intervals_and_bands_cover_what_they_say() -> None:
    """Of 300 studies with a known fragility, 95 % intervals hold it in 95 % of them, give or take."""
    held, probe = np.zeros(4), np.array([0.6, 1.4])
    truth = norm.cdf(np.log(probe / 1.1) / 0.4)
    for seed in range(300):
        state = fragility(lognormal_rows(1.1, 0.4, 40, seed), "scale", "demand", [1.0]).states[0]
        low, high = state.band(probe)
        inside = (low <= truth) & (truth <= high)
        median = state.median_interval[0] <= 1.1 <= state.median_interval[1]
        dispersion = state.dispersion_interval[0] <= 0.4 <= state.dispersion_interval[1]
        held += [median, dispersion, *inside]
    # Three standard deviations of a share of 300 are 0.038.
    assert (held / 300 >= 0.912).all() and (held / 300 <= 0.988).all()


def test_the_bootstrap_knows_that_runs_of_a_record_depend_on_each_other() -> None:
    """One capacity for each record: taking its six runs for independent makes the interval too narrow."""
    rng = np.random.default_rng(2)
    capacity = np.repeat(1.1 * np.exp(0.4 * rng.standard_normal(60)), len(LEVELS))
    x = np.tile(LEVELS, 60)
    record = np.repeat([f"r{k}" for k in range(60)], len(LEVELS))
    rows = rows_like(record=record, scale=x, demand=x / capacity)
    plain = fragility(rows, "scale", "demand", [1.0]).states[0]
    drawn = fragility(rows, "scale", "demand", [1.0], bootstrap=400, seed=1).states[0]
    again = fragility(rows, "scale", "demand", [1.0], bootstrap=400, seed=1).states[0]
    assert drawn.median == plain.median and drawn.median_interval == again.median_interval
    widths = [np.log(state.median_interval[1] / state.median_interval[0]) for state in (plain, drawn)]
    assert widths[1] > 1.1 * widths[0]
    expected = 2 * 1.96 * 0.4 / np.sqrt(60)  # of the mean of 60 known capacities, a lower bound
    assert 0.9 * expected < widths[1] < 2 * expected
    low, high = drawn.band(LEVELS)
    assert (low < drawn.probability(LEVELS)).all() and (drawn.probability(LEVELS) < high).all()


def test_runs_that_ended_early_exceed_what_they_reached() -> None:
    rows = lognormal_rows(1.1, 0.4, 40, seed=5)
    cut = rows.copy()
    beyond = cut.demand > 1.2
    cut.loc[beyond, "status"], cut.loc[beyond, "demand"] = "stopped", 1.2
    expected = fragility(rows, "scale", "demand", [1.0]).states[0]
    for early in ("leave-out", "exceed", "refuse"):
        assert fragility(cut, "scale", "demand", [1.0], early=early).states[0].median == expected.median
    unknown = int(beyond.sum())
    with pytest.raises(InputError, match=rf"{unknown} runs ended early below demand = 1.5"):
        fragility(cut, "scale", "demand", [1.5], early="refuse")
    with pytest.raises(InputError, match=r"threshold 1.5 of demand: none of"):
        fragility(cut, "scale", "demand", [1.5])
    assert fragility(cut, "scale", "demand", [1.5], early="exceed").states[0].exceeded == unknown
    cut.loc[0, "status"] = "newton"  # at a demand below the threshold
    assert fragility(cut, "scale", "demand", [1.0]).states[0].left_out == 1


def gaps(count: int = 60) -> pd.DataFrame:
    """A gap that falls with the scale, 1 - x/capacity; runs end where it is closed, some with a gap that was left."""
    rng = np.random.default_rng(7)
    x = np.tile(LEVELS, count)
    capacity = 1.1 * np.exp(0.4 * rng.standard_normal(len(x)))
    gap = 1.0 - x / capacity
    ended = gap < 0
    left = np.where(ended, np.where(rng.random(len(x)) < 0.5, 0.0, 0.3), gap)
    record = np.repeat([f"r{k}" for k in range(count)], len(LEVELS))
    rows = rows_like(record=record, scale=x, demand=left, status=np.where(ended, "stopped", "ok"))
    rows.attrs["sides"] = {"demand": "least"}
    return rows


def test_runs_that_ended_early_count_below_where_the_least_is_the_worst() -> None:
    """A gap can only get smaller: fractiles fall with the scale, and a run exceeds a gap from below."""
    rows = gaps()
    truth = (np.where(rows.status == "ok", rows.demand, -1.0) <= 0.1).astype(float)
    exceeded = fragility(rows, "scale", "demand", [0.1], early="exceed").states[0]
    assert exceeded.exceeded == int(truth.sum()) and exceeded.left_out == 0
    assert (np.diff(exceeded.exceeded_at / exceeded.runs_at) > 0).all()
    unknown = int(((rows.status != "ok") & (rows.demand > 0.1)).sum())
    assert unknown > 10 and fragility(rows, "scale", "demand", [0.1]).states[0].left_out == unknown
    with pytest.raises(InputError, match=rf"{unknown} runs ended early above demand = 0.1"):
        fragility(rows, "scale", "demand", [0.1], early="refuse")
    found = ida(rows, "scale", "demand").fractiles
    for name in ("p16", "p50", "p84"):
        finite = found[name][np.isfinite(found[name])]
        assert len(finite) and (np.diff(finite) < 0).all() and not (found[name] == np.inf).any()
    assert np.isneginf(found["p16"].iloc[-1])
    plot_ida(ida(rows, "scale", "demand"))


def test_least_values_of_different_intensities_begin_where_all_curves_do() -> None:
    rows = rows_like(
        record=["a"] * 3 + ["b"] * 3, scale=[1.0, 2.0, 3.0] * 2, intensity=[1.0, 2.0, 3.0, 1.5, 3.0, 4.5],
        demand=[0.8, 0.6, 0.4, 0.9, 0.7, 0.5],
    )  # fmt: skip
    rows.attrs["sides"] = {"demand": "least"}
    found = ida(rows, "intensity", "demand").fractiles
    assert found.intensity.iloc[0] == 1.5 and found["p16"].iloc[0] == pytest.approx(0.7)


def test_a_demand_that_is_no_extreme_says_nothing_in_a_run_that_ended_early() -> None:
    rows = gaps()
    rows.attrs["sides"] = {"demand": ""}
    early = int((rows.status != "ok").sum())
    with pytest.raises(InputError, match=rf"demand: {early} runs ended early, and it is neither the largest nor"):
        ida(rows, "scale", "demand")
    with pytest.raises(InputError, match=rf"{early} runs ended early and do not bound demand"):
        fragility(rows, "scale", "demand", [0.1], early="refuse")


SIDES = {
    "peak_displacement": "most", "minimum_gap_1": "least", "capacity_used_2": "most", "residual_displacement": "",
    "effective_damping": "", "most_friction_1": "most", "least_friction_1": "least", "capacity_left_1": "least",
}  # fmt: skip
FORMULAS = {
    "Max(capacity_used_1, capacity_used_4)": "most",
    "least(normal_force_1) / 112e3": "least",
    "1 - minimum_gap_1 / 0.2": "most",
    "Min(minimum_gap_1, minimum_gap_2) - 2 * peak_displacement": "least",
    "peak_displacement - peak_sliding_1": "",
    "peak_force / peak_displacement": "",
    "last(displacement_E1)": "",
    "sqrt(peak(displacement_E1))": "most",
    "Abs(minimum_gap_1)": "",
    "peak_force * factor": "",
}


def test_every_column_knows_how_a_run_that_ended_early_bounds_it(tmp_path: Path) -> None:
    """It is written with the rows, and read from them."""
    quantities = {f"q{number}": text for number, text in enumerate(FORMULAS)}
    names = sorted({re.sub(r"_\d$", "", name) for name in SIDES})
    axes = {"factor": {"sets": "motion.amplitude", "values": [0.003]}}
    made = load_study({"scene": "fenz-test1", "keep": names, "quantities": quantities, "axes": axes})
    expected = SIDES | dict(zip(quantities, FORMULAS.values(), strict=True))
    assert {name: made.keep.side(name) for name in expected} == expected
    msfp_gen.study(made, tmp_path, workers=1)
    sides = read_study(tmp_path).attrs["sides"]
    assert {name: sides[name] for name in expected} == expected and side_of(read_study(tmp_path), "q1") == "least"


def test_several_damage_states_are_sorted_and_written_with_their_bands() -> None:
    found = fragility(lognormal_rows(1.1, 0.4, 60, seed=5), "scale", "demand", [1.2, 0.8])
    assert [state.threshold for state in found.states] == [0.8, 1.2]
    assert found.states[0].median < found.states[1].median
    frame = fragility_frame(found)
    assert set(frame.columns) == {"case", "threshold", "scale", "probability", "low", "high"}
    assert (frame.low < frame.probability).all() and (frame.probability < frame.high).all()
    json.dumps(found.as_dict(), allow_nan=False)


def test_cases_are_fitted_apart() -> None:
    weak, strong = lognormal_rows(0.8, 0.4, 60, seed=5), lognormal_rows(1.4, 0.3, 60, seed=6)
    rows = pd.concat([weak.assign(record="weak"), strong.assign(record="strong")], ignore_index=True)
    found = fragility(rows, "scale", "demand", [1.0], by="record").states
    alone = [fragility(each, "scale", "demand", [1.0]).states[0] for each in (weak, strong)]
    assert [state.case for state in found] == ["weak", "strong"]
    assert [state.median for state in found] == [state.median for state in alone]
    with pytest.raises(InputError, match="bounds: no column"):
        fragility(rows, "scale", "demand", [1.0], by="bounds")


X = np.tile(LEVELS, 4)
NO_CURVE = {
    "none of 24 runs exceed": 0.1 * X,
    "all of 24 runs exceed": 10 * X,
    "no run below 1 exceeds it and every run above 0.75 does": np.where(X >= 1, 2.0, 0.5),
    "exceedances do not grow with the intensity": np.where(X <= 0.5, 2.0, 0.5),
}


@pytest.mark.parametrize("message", NO_CURVE)
def test_runs_that_determine_no_curve_are_refused(message: str) -> None:
    with pytest.raises(InputError, match=rf"threshold 1 of demand: {message}"):
        fragility(rows_like(scale=X, demand=NO_CURVE[message]), "scale", "demand", [1.0])


def test_bad_arguments_are_named() -> None:
    rows = lognormal_rows(1.1, 0.4, 10, seed=1)
    cases: list[tuple[dict[str, Any], str]] = [
        ({"measure": "scael"}, "scael: no column of this study; did you mean 'scale'"),
        ({"demand": "status"}, "status: this column holds texts"),
        ({"thresholds": []}, "thresholds = \\[\\]: give one or more"),
        ({"level": 1.0}, "level = 1: give a share"),
        ({"early": "maybe"}, "early = 'maybe': give one of 'leave-out'"),
        ({"bootstrap": 5}, "bootstrap = 5: give at least 100"),
        ({"bootstrap": 200}, "record: no column"),
    ]
    for change, message in cases:
        with pytest.raises(InputError, match=message):
            fragility(rows, **{"measure": "scale", "demand": "demand", "thresholds": [1.0], **change})
    with pytest.raises(InputError, match=r"fractiles = .2.: give shares"):
        ida(rows, "scale", "demand", [2])
    with pytest.raises(InputError, match="an IDA needs several intensities of each record; curve 1 has one"):
        ida(rows[rows.scale == 1.0], "scale", "demand")
    with pytest.raises(InputError, match="an intensity measure is above 0"):
        ida(rows.assign(scale=0.0), "scale", "demand")
    with pytest.raises(InputError, match=r"'x=1': no run has this value|x: no column"):
        chosen_rows(rows, ["x=1"])
    assert len(chosen_rows(rows, ["scale=0.5"])) == 10


FREE = {"distribution": "uniform", "low": 1.0, "high": 2.0}


@pytest.fixture(scope="module")
def one_at_a_time(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose quantity is a formula of its axes; the runs themselves do not matter."""
    folder = tmp_path_factory.mktemp("tornado")
    axes = {
        "case": {"values": [1.0, 2.0, 6.0]},
        "a": FREE,
        "b": {"distribution": "uniform", "low": 0.0, "high": 10.0},
    }
    quantities = {"found": "case * (2 * a + b)"}
    table = cheap_study(axes=axes, quantities=quantities, sampling={"method": "one-at-a-time"})
    msfp_gen.study(table, folder)
    return folder


def test_a_tornado_has_each_axis_alone(one_at_a_time: Path) -> None:
    found = tornado(one_at_a_time, "found")  # the median over the cases is that of case 2
    assert found.base == pytest.approx(2 * (2 * 1.5 + 5)) and found.quantiles == (0.1, 0.9)
    assert [bar.axis for bar in found.bars] == ["b", "a"]
    assert (found.bars[0].low, found.bars[0].high) == pytest.approx((1.0, 9.0))
    assert (found.bars[0].at_low, found.bars[0].at_high) == pytest.approx((8.0, 24.0))
    assert found.bars[1].swing == pytest.approx(2 * 2 * 0.8)
    assert tornado(one_at_a_time, "found", "max").base == pytest.approx(6 * 8)


def test_sensitivity_needs_its_sampling_and_all_runs(one_at_a_time: Path, tmp_path: Path) -> None:
    msfp_gen.study(cheap_study(), tmp_path / "other")
    with pytest.raises(InputError, match=r"needs a study with sampling.method = 'one-at-a-time'"):
        tornado(tmp_path / "other", "peak_displacement")
    with pytest.raises(InputError, match="statistic = 'mode': give one of median"):
        tornado(one_at_a_time, "found", "mode")
    table = cheap_study(sampling={"method": "one-at-a-time"}, chunk=2)
    msfp_gen.study(table, tmp_path / "half", shard=(1, 2))
    with pytest.raises(InputError, match="4 of 6 runs are done; complete the study"):
        tornado(tmp_path / "half", "peak_displacement")


def test_rows_open_in_pandas_and_duckdb(one_at_a_time: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    rows = read_study(one_at_a_time, ["found"])
    assert list(rows.columns) == ["run", "status", "found"] and len(rows) == 15
    found = duckdb.sql(f"select count(*), sum(found) from '{one_at_a_time}/part-*.parquet'").fetchall()
    assert found[0] == (15, pytest.approx(rows.found.sum()))
    with pytest.raises(InputError, match="foundd: no column of this study; did you mean 'found'"):
        read_study(one_at_a_time, ["foundd"])


@pytest.fixture(scope="module")
def analytic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose demand over capacity is known: capacity lognormal, demand the intensity itself."""
    folder = tmp_path_factory.mktemp("analytic")
    axes = {
        "capacity": {"distribution": "lognormal", "median": 1.2, "dispersion": 0.4},
        "scale": {"distribution": "uniform", "low": 0.3, "high": 3.0},
    }
    quantities = {"ratio": "scale / capacity"}
    table = cheap_study(axes=axes, quantities=quantities, sampling={"samples": 64, "method": "random"}, chunk=32)
    msfp_gen.study(table, folder)
    return folder


def test_commands_print_write_and_draw(
    analytic: Path, one_at_a_time: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = [str(analytic), "--demand", "ratio"]
    figure, table = str(tmp_path / "f.png"), str(tmp_path / "f.csv")
    assert main(["study", "fragility", *place, "--thresholds", "0.8,1", "--plot", figure, "-o", table]) == 0
    out, err = capsys.readouterr()
    assert "dispersion" in out and err == f"wrote {table}\nwrote {figure}\n"
    assert set(pd.read_csv(table).threshold) == {0.8, 1.0}
    assert main(["study", "fragility", *place, "--thresholds", "1", "--json"]) == 0
    (state,) = json.loads(capsys.readouterr().out)["states"]
    assert state["median_interval"][0] < 1.2 < state["median_interval"][1]
    ida_place = ["study", "ida", str(one_at_a_time), "--measure", "case", "--demand", "found"]
    assert main([*ida_place, "--plot", str(tmp_path / "i.svg"), "-o", str(tmp_path / "i.parquet")]) == 0
    assert list(pd.read_parquet(tmp_path / "i.parquet").case) == [1, 2, 6]
    assert main([*ida_place, "--json", "--where", "case=0"]) == 2
    assert "'case=0': no run has this value" in capsys.readouterr().err
    assert main(["study", "tornado", str(one_at_a_time), "--quantity", "found", "--plot", str(tmp_path / "t.pdf")]) == 0
    assert "median of found: 16 at medians" in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {"f.png", "f.csv", "i.svg", "i.parquet", "t.pdf"}
    assert main(["study", "fragility", *place, "--thresholds", "1", "--plot", "f.gif"]) == 2
    assert "--plot = 'f.gif'" in capsys.readouterr().err
