"""Estimates from cheap and exact runs: closed forms, estimators on models with known answers, and the study itself."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from msfp_gen import Effects, InputError, Motion, load_scene
from msfp_gen.scene.fidelity import Backbone, at_fidelity
from msfp_gen.scene.file.loader import bearing_from_table
from msfp_gen.studies import estimate, fragility, ida, read_study
from msfp_gen.studies.batch import run_to_end
from msfp_gen.studies.definition import example_text
from msfp_gen.studies.estimation.backbone_run import parallel
from msfp_gen.studies.estimation.estimate import Question, estimate_table, estimated, fragility_of, plot_estimate
from msfp_gen.studies.estimation.estimators import (
    Runs,
    best_chain,
    exceeding,
    optimal_runs,
    quantile_of,
    shares_of_variance,
    telescoped,
    work_of,
)
from msfp_gen.studies.estimation.source import crossings

SPREAD, NOISE = 0.5, 0.1  # standard deviation of the logarithm, and share of it that the cheap model does not see


class Lognormal:
    """A source of a lognormal quantity with known moments; the cheap model has a bias and another spread."""

    def __init__(self, seed=0, noise=NOISE, cost=0.01, levels=("exact", "backbone"), population=None, fails=0.0):
        self.levels, self.population = levels, population
        rng = np.random.default_rng([seed, 5])
        count = population or 200_000
        hidden, other = rng.standard_normal((2, count))
        exact = np.exp(SPREAD * (hidden + noise * other))
        self._values = {
            "exact": exact,
            "backbone": 1.1 * np.exp(0.45 * hidden),
            "massless": exact * np.exp(0.01 * rng.standard_normal(count)),
        }
        self._early = rng.random(count) < fails
        self._costs = {"exact": 1.0, "backbone": cost, "massless": 0.3}
        self._done = {level: set() for level in levels}

    def values(self, level, draws, scales=None):
        self._done[level] |= set(draws.tolist())
        early = self._early[draws] if level == "exact" else np.zeros(len(draws), dtype=bool)
        return self._values[level][draws], early

    def cost(self, level):
        return self._costs[level]

    def spent(self):
        runs = {level: len(done) for level, done in self._done.items() if done}
        return sum(self._costs[level] * count for level, count in runs.items()), runs


def truth(noise=NOISE):
    return SPREAD**2 * (1 + noise**2)


def test_the_allocation_is_the_optimum_of_a_search():
    shares = shares_of_variance(np.array([1.0, 0.999, 0.97]))
    costs = np.array([1.0, 0.3, 0.002])
    runs = optimal_runs(shares, costs, variance=1e-3)
    assert shares @ (1 / runs) == pytest.approx(1e-3)
    found = minimize(
        lambda logs: np.exp(logs) @ costs, np.log(runs) + 0.3, constraints=[
            {"type": "eq", "fun": lambda logs: 1e3 * (shares @ np.exp(-logs)) - 1}
        ],
    )  # fmt: skip
    assert runs @ costs == pytest.approx(found.fun, rel=1e-6)
    assert work_of(shares, costs) == pytest.approx(runs @ costs * 1e-3, rel=1e-9)
    assert optimal_runs(shares, costs, seconds=60.0) @ costs == pytest.approx(60.0)


def test_the_published_ratio_of_two_models():
    """Peherstorfer et al. (2016), (3.5): r = sqrt(w_1 rho^2 / (w_2 (1 - rho^2)))."""
    runs = optimal_runs(shares_of_variance(np.array([1.0, 0.9])), np.array([1.0, 0.01]), variance=1.0)
    assert runs[1] / runs[0] == pytest.approx(np.sqrt(0.81 / (0.01 * 0.19)))


@pytest.mark.slow
@pytest.mark.parametrize("correlations", [(1.0, 0.97, 0.9), (1.0, 0.995, 0.8), (1.0, 0.9)])
def test_allocation_and_variance_are_those_of_mxmcpy(correlations):
    """NASA's program, which needs PyTorch: pip install mxmcpy torch."""
    optimizer = pytest.importorskip("mxmc").Optimizer
    rho, spread = np.array(correlations), np.array([2.0, 1.5, 0.7])[: len(correlations)]
    costs = np.array([100.0, 5.0, 1.0])[[0, *range(-len(rho) + 1, 0)]]
    matrix = np.minimum.outer(rho, rho) / np.maximum.outer(rho, rho)  # the cheaper through the better ones
    matrix[0], matrix[:, 0] = rho, rho
    theirs = optimizer(costs, np.outer(spread, spread) * matrix).optimize("mfmc", target_cost=1e6)
    variances = shares_of_variance(rho) * spread[0] ** 2
    runs = optimal_runs(variances, costs, seconds=1e6)
    assert theirs.allocation.get_number_of_samples_per_model() == pytest.approx(runs, abs=1.0)
    assert theirs.variance == pytest.approx(variances @ (1 / runs), rel=1e-3)


def test_the_chain_leaves_out_what_does_not_pay():
    costs = {"exact": 1.0, "massless": 0.5, "backbone": 0.01}
    assert best_chain({"exact": 1.0, "massless": 0.99999, "backbone": 0.9}, costs).models == (
        "exact", "massless", "backbone",
    )  # fmt: skip
    assert best_chain({"exact": 1.0, "massless": 0.99, "backbone": 0.9999}, costs).models == ("exact", "backbone")
    assert best_chain({"exact": 1.0, "backbone": 0.05}, costs | {"backbone": 0.5}).models == ("exact",)


@pytest.mark.slow
def test_the_variance_is_that_of_repetitions():
    """Brute force: the stated variance of an estimate of three levels against that of two hundred repetitions."""
    values, variances = [], []
    for seed in range(200):
        source = Lognormal(seed, levels=("exact", "massless", "backbone"))
        rng = np.random.default_rng([seed, 9])
        uniform, draws = rng.random(2000), np.arange(2000)
        levels = []
        for level, chance in (("exact", 0.05), ("massless", 0.2), ("backbone", 1.0)):
            chances = np.where(draws < 40, 1.0, chance)
            here = draws[uniform < chances]
            levels.append(Runs(here, source.values(level, here)[0], chances[here]))
        moment = telescoped(levels[0].values, levels, 40)
        values.append(moment.value)
        variances.append(moment.variance)
    assert np.mean(values) == pytest.approx(np.exp(truth() / 2), abs=4 * np.std(values) / np.sqrt(200))
    assert np.mean(variances) == pytest.approx(np.var(values), rel=0.3)


CASES = {
    "mean": ("mean", None, 0.03, lambda: np.exp(truth() / 2)),
    "probability": ("probability", 2.0, 0.02, lambda: norm.sf(np.log(2.0) / np.sqrt(truth()))),
}
RARE = float(np.exp(norm.isf(1e-3) * np.sqrt(truth())))  # what one draw in a thousand reaches


@pytest.mark.parametrize("case", ["mean", pytest.param("probability", marks=pytest.mark.slow)])
def test_intervals_hold_the_truth(case):
    """Of a hundred intervals of 95 % at least 88 hold it (a chance of 0.4 % for fewer); few exact runs suffice."""
    statistic, threshold, target, value = CASES[case]
    held, gains = 0, []
    for seed in range(100):
        found = estimated(Lognormal(seed), Question("q", statistic, threshold, target=target, seed=seed))
        held += found.interval[0] <= value() <= found.interval[1]
        gains.append(found.plain_seconds / found.seconds)
    assert held >= 88 and np.median(gains) > 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statistic", "threshold", "target", "value"), [
        ("mean", None, 0.03, np.exp(truth() / 2)),
        ("probability", 2.0, 0.02, norm.sf(np.log(2.0) / np.sqrt(truth()))),
        ("probability", RARE, 3e-4, 1e-3),
        ("quantile", 0.8, 0.03, np.exp(0.8416212 * np.sqrt(truth()))),
    ],
)  # fmt: skip
def test_coverage_over_many_repetitions(statistic, threshold, target, value):
    held, gains = 0, []
    for seed in range(400):
        found = estimated(Lognormal(seed), Question("q", statistic, threshold, target=target, seed=seed))
        held += found.interval[0] <= value <= found.interval[1]
        gains.append(found.plain_seconds / found.seconds)
    assert 0.92 <= held / 400 <= 0.98 and np.median(gains) > 3


class Overshooting(Lognormal):
    """A cheap model that is right but for one draw in fifty, of which it makes a hundred times too much."""

    def __init__(self, seed):
        super().__init__(seed, cost=0.02)
        rng = np.random.default_rng([seed, 6])
        exact = np.exp(0.3 * rng.standard_normal(200_000))
        rare = rng.random(len(exact)) < 0.02
        close = exact * np.exp(0.01 * rng.standard_normal(len(exact)))
        self._values = {"exact": np.where(rare, 5 * exact, exact), "backbone": np.where(rare, 500 * exact, close)}


def test_a_wrong_prediction_of_few_draws_does_not_leave_out_the_others():
    """Exact runs at the rare draws alone left intervals that were off by up to six half widths."""
    for seed in range(12):
        source = Overshooting(seed)
        found = estimated(source, Question("q", target=0.02, seed=seed))
        assert abs(found.value - source._values["exact"].mean()) < 2 * found.half


def test_no_benefit_runs_plainly_and_says_so():
    found = estimated(Lognormal(noise=30.0), Question("q", target=0.5, pilot=64, budget=1e9))
    assert set(found.runs) >= {"exact"} and any("no cheaper model" in line for line in found.notes)


def test_a_population_that_is_run_whole_has_no_error():
    source = Lognormal(population=60)
    found = estimated(source, Question("q", target=1e-6, pilot=32))
    assert found.value == pytest.approx(source._values["exact"].mean(), rel=1e-9) and found.half < 1e-9


def test_runs_that_end_early_count_as_above():
    """A tenth of all runs fails: the probability to be above a bound that few reach is that tenth.

    Of twenty intervals of 95 % at least 17 hold it (a chance of 1.6 % for fewer).
    """
    every = [
        estimated(Lognormal(seed, fails=0.1), Question("q", "probability", 20.0, target=0.02, seed=seed))
        for seed in range(20)
    ]
    assert sum(found.interval[0] <= 0.1 <= found.interval[1] for found in every) >= 17
    assert all("ended early" in " ".join(found.notes) for found in every if found.value > 0)


def test_runs_that_end_early_count_as_below_where_the_least_is_the_worst():
    """A tenth of all runs fails: all others are above a bound that nearly all exceed."""
    question = Question("q", "probability", 1e-3, target=0.02, side="least")
    found = estimated(Lognormal(3, fails=0.1), question)
    assert found.value == pytest.approx(0.9, abs=0.03)
    assert "count as below every value" in " ".join(found.notes)
    with pytest.raises(InputError, match="ended early, and it is neither the largest nor the least value"):
        estimated(Lognormal(3, fails=0.1), replace(question, side=""))


def test_a_budget_that_does_not_permit_the_target_is_one_line():
    with pytest.raises(InputError, match="budget = 40 s: give a target of") as error:
        estimated(Lognormal(), Question("q", target=1e-4, budget=40.0))
    assert "\n" not in str(error.value)


def test_a_budget_is_kept():
    found = estimated(Lognormal(), Question("q", budget=120.0))
    assert 60 < found.seconds < 130


def test_levels_of_a_quantile():
    source, draws = Lognormal(), np.arange(4000)
    levels = [Runs(draws[:200], source.values("exact", draws[:200])[0], np.ones(200))]
    levels.append(Runs(draws, source.values("backbone", draws)[0], np.ones(4000)))
    value, (low, high), _ = quantile_of(levels, 0.5, 200)
    assert low < value < high and low <= 1.0 <= high
    assert exceeding(levels, value, 200).value == pytest.approx(0.5, abs=0.01)


class PowerLaw(Lognormal):
    """Draws whose quantity grows with the square of the scale, and reaches 1 at scales of known distribution."""

    scales = np.linspace(0.25, 4.0, 16)

    def values(self, level, draws, scales=None):
        values, early = super().values(level, draws)
        self._done[level] |= {(draw, scale) for draw, scale in zip(draws.tolist(), scales.tolist(), strict=True)}
        return (self.scales[scales] / 1.5) ** 2 / values**2, early


def test_crossings_take_few_runs():
    source, draws = PowerLaw(), np.arange(200)
    known = np.log(1.5 * source._values["exact"][:200])
    found = crossings(source, "exact", draws, source.scales, 1.0, known)
    inside = (known > np.log(0.25)) & (known < np.log(4.0))
    assert found.logarithms[inside] == pytest.approx(known[inside], abs=1e-9)
    assert found.runs < 3.2 * 200 and found.beyond == (~inside).sum()


def test_a_fragility_has_the_known_median_and_dispersion():
    source = PowerLaw()
    found = fragility_of(
        source, Question("q", "fragility", 1.0, target=0.03), source.scales, lambda d: np.zeros(len(d))
    )
    assert found.interval[0] <= 1.5 <= found.interval[1]
    assert found.dispersion == pytest.approx(np.sqrt(truth()), rel=0.2)


@pytest.mark.parametrize(("name", "factor"), [("prototype-tfp", 1.0), ("fenz-tfp", 1.6), ("quintuple-fp", 2.1229)])
def test_the_backbone_in_parallel_is_the_backbone(name, factor):
    """Also where its slope rises before it is least: with this friction a rim is met before the last surface slides."""
    bearing = bearing_from_table({"preset": name})
    bearing = bearing.replace(friction=[factor * surface.friction for surface in bearing.surfaces])
    backbone = Backbone.of(bearing, 112e3)
    elements, spring, gaps = parallel(backbone)
    for u in np.linspace(0.0, 1.3 * backbone.capacity, 27):
        force = spring * u + np.minimum(elements[0] * u, elements[1]).sum()
        force += (gaps[1] * np.maximum(u - gaps[0], 0)).sum()
        assert force == pytest.approx(backbone.force(u), rel=1e-9)


@pytest.mark.parametrize("rims", [True, False])
def test_the_backbone_meets_its_rims_as_the_bearing_does(rims):
    """A pulse that presses all sliders on their rims, which multiplies the shear; without rims they go beyond."""
    times = np.arange(0.0, 6.0, 0.01)
    pulse = 2.0 * np.sin(2 * np.pi * times / 2.5) * (times < 2.5)
    motion = Motion.from_acceleration(times, np.outer(pulse, [1.0, 0.3 * rims, 0.0]))
    given = load_scene("ridgecrest-clc")
    effects = replace(given.effects, friction="constant") if rims else Effects(dimension="planar", rims=False)
    scene = replace(
        given, motion=motion, motion_table=None, duration=None, bearing=given.bearing.replace(reference_pressure=None),
        effects=effects, solver=replace(given.solver, rtol=1e-3),
    )  # fmt: skip
    exact, cheap = run_to_end(scene).summary, run_to_end(at_fidelity(scene, "backbone")).summary
    assert max(exact["minimum_gap"][0], cheap["minimum_gap"][0]) < 0
    assert (exact["peak_force"]["radial"] > 150e3) == rims
    for name in ("peak_displacement", "peak_force"):
        assert cheap[name]["radial"] == pytest.approx(exact[name]["radial"], rel=0.1)


def test_a_run_of_the_backbone_follows_the_exact_one():
    scene = load_scene("ridgecrest-clc")
    scene = replace(scene, duration=20.0, solver=replace(scene.solver, rtol=1e-3))
    exact, cheap = run_to_end(scene), run_to_end(at_fidelity(scene, "backbone"))
    for name in ("peak_displacement", "peak_force"):
        assert cheap.summary[name]["radial"] == pytest.approx(exact.summary[name]["radial"], rel=0.3)


def small_study(**changes):
    table = tomllib.loads(example_text())
    table["records"] = {
        "motions": [
            {"bundled": f"ridgecrest-2019-ci-{name}", "components": ["E1"], "duration": 10.0} for name in ("ccc", "clc")
        ],
        "scales": [0.5, 1.0, 1.5],
    }
    return {**table, "keep": ["peak_displacement", "peak_force", "minimum_gap"], **changes}


def test_an_estimate_of_a_study_is_kept_and_continued(tmp_path):
    table = small_study(accuracy={"quantity": "peak_displacement", "target": "30 %", "pilot": 16})
    first = estimate(table, tmp_path / "out", threads=True, workers=1)
    rows = read_study(tmp_path / "out")
    assert len(rows) == first.runs["exact"] >= 16 and "peak_force" in rows.columns
    assert (tmp_path / "out" / "backbone" / "study.toml").is_file() and first.correlation["backbone"] > 0.8
    for curve in (lambda: ida(rows, "scale", "peak_force"), lambda: fragility(rows, "scale", "peak_force", [1e4])):
        with pytest.raises(InputError, match="runs of an estimate were chosen"):
            curve()
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("part-*")}
    again = estimate(table, tmp_path / "out", threads=True, workers=1)
    assert again.value == first.value and again.interval == first.interval
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("part-*")} == times
    tighter = estimate(table, tmp_path / "out", target="15 %", threads=True, workers=1)
    assert tighter.runs["exact"] >= first.runs["exact"] and tighter.half < first.half
    assert len(estimate_table(tighter).rows) <= 10
    plot_estimate(tighter, tmp_path / "e.png")
    assert (tmp_path / "e.png").stat().st_size > 10_000


BAD = {
    "no goal": ({}, "give target, such as '2 %', or budget"),
    "no quantity": ({"target": "2 %"}, "accuracy.quantity is missing"),
    "unknown quantity": ({"quantity": "peak_force_ratio", "target": 0.1}, "the study keeps"),
    "not of the cheap model": ({"quantity": "normal", "target": 0.1}, "none of the model 'backbone'"),
    "threshold": ({"quantity": "peak_force", "statistic": "probability", "target": 0.1}, "accuracy.threshold"),
    "text": ({"quantity": "peak_force", "target": "two"}, "accuracy.target = 'two'"),
    "models": ({"quantity": "peak_force", "target": 0.1, "models": ["cheap"]}, "accuracy.models has 'cheap'"),
    "no such model": ({"quantity": "peak_force", "target": 0.1, "models": ["rigid"]}, "one bearing has no such model"),
    "no cheaper model": ({"quantity": "peak_force", "target": 0.1}, "the model 'backbone' carries a mass"),
    "rims unseen": ({"quantity": "peak_force", "target": 0.1}, "stop.all_rims: the model 'backbone' does not see"),
    "key": ({"quantity": "peak_force", "goal": 0.1}, "accuracy.goal: no such key"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_writes_nothing(tmp_path, case):
    accuracy, text = BAD[case]
    table = small_study(accuracy=accuracy, quantities={"normal": "least(normal_force_1)"})
    if case == "no cheaper model":
        table["scene"] = {**table["scene"], "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e9}}
    if case == "rims unseen":
        table["scene"] = {**table["scene"], "stop": {"all_rims": True}}
    with pytest.raises(InputError, match=text) as error:
        estimate(table, tmp_path / "out", threads=True)
    assert "\n" not in str(error.value) and not (tmp_path / "out").exists()


def test_a_target_beyond_the_budget_leaves_no_folder(tmp_path):
    """Its pilot is needed to know; a folder that was there before keeps its runs."""
    goal = {"quantity": "peak_displacement", "target": "0.01 %", "pilot": 16, "budget": "1 s"}
    with pytest.raises(InputError, match="budget = 1 s: give a target of") as error:
        estimate(small_study(accuracy=goal), tmp_path / "out", threads=True)
    assert "\n" not in str(error.value) and not (tmp_path / "out").exists()


@pytest.mark.slow
def test_an_estimate_on_dask_has_the_same_runs(tmp_path):
    distributed = pytest.importorskip("distributed")
    table = small_study(accuracy={"quantity": "peak_displacement", "target": "30 %", "pilot": 16})
    local = estimate(table, tmp_path / "threads", threads=True, workers=2)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50)
    with cluster, distributed.Client(cluster) as client:
        spread = estimate(table, tmp_path / "dask", executor=client.get_executor(pure=False), workers=2)
    first, second = (read_study(tmp_path / name).head(16).peak_displacement for name in ("threads", "dask"))
    assert (first == second).all() and spread.runs["exact"] >= 16
    assert spread.value == pytest.approx(local.value, abs=spread.half + local.half)


@pytest.mark.slow
def test_the_hospital_is_a_base_scene(tmp_path):
    table = {
        "scene": "hospital-clc",
        "keep": ["peak_force"],
        "records": {
            "motions": [{"bundled": "ridgecrest-2019-ci-clc", "duration": 4.0}],
            "scales": [0.4, 0.6, 0.8, 1.0],
        },
        "axes": {"damping": {"sets": "building.damping_ratio", "distribution": "uniform", "low": 0.02, "high": 0.08}},
        "sampling": {"samples": 4},
    }
    found = estimate(
        table, tmp_path / "out", "peak_force", target=0.5, pilot=16, models=["backbone"], threads=True, workers=1
    )
    assert found.interval[0] < found.value < found.interval[1] and found.correlation["backbone"] > 0.8
