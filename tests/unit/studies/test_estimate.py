"""Estimates from cheap and exact runs: closed forms, estimators on models with known answers, and the study itself."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import binom, norm, t

from msfp_gen import InputError
from msfp_gen.studies import estimate, read_study
from msfp_gen.studies.definition import example_text
from msfp_gen.studies.estimation.estimate import PILOT, Question, _State, estimate_table, estimated, plot_estimate
from msfp_gen.studies.estimation.estimators import mean_of, optimal_runs, work

SPREAD, NOISE = 0.5, 0.1  # standard deviation of the logarithm, and share of it that the cheap model does not see


class Lognormal:
    """A source of a lognormal quantity with known moments; the cheap model has a bias and another spread."""

    def __init__(self, seed=0, noise=NOISE, cost=0.01, levels=("exact", "equivalent"), population=None, fails=0.0):
        self.levels, self.population = levels, population
        rng = np.random.default_rng([seed, 5])
        count = population or 200_000
        hidden, other = rng.standard_normal((2, count))
        exact = np.exp(SPREAD * (hidden + noise * other))
        self._values = {
            "exact": exact,
            "equivalent": 1.1 * np.exp(0.45 * hidden),
            "massless": exact * np.exp(0.01 * rng.standard_normal(count)),
        }
        self._early = rng.random(count) < fails
        self._costs = {"exact": 1.0, "equivalent": cost, "massless": 0.3}
        self._done = dict.fromkeys(levels, 0)

    def values(self, level, count):
        self._done[level] = max(count, self._done[level])
        early = self._early[:count] if level == "exact" else np.zeros(count, dtype=bool)
        return self._values[level][:count], early

    def cost(self, level):
        return self._costs[level]

    def spent(self):
        runs = {level: done for level, done in self._done.items() if done}
        return sum(self._costs[level] * count for level, count in runs.items()), runs


def truth(noise=NOISE):
    return SPREAD**2 * (1 + noise**2)


def test_the_allocation_is_the_optimum_of_a_search():
    variances, costs = np.array([0.06, 0.94]), np.array([1.0, 0.002])
    runs = optimal_runs(variances, costs, variance=1e-3)
    assert variances @ (1 / runs) == pytest.approx(1e-3)
    found = minimize(
        lambda logs: np.exp(logs) @ costs, np.log(runs) + 0.3, constraints=[
            {"type": "eq", "fun": lambda logs: 1e3 * (variances @ np.exp(-logs)) - 1}
        ],
    )  # fmt: skip
    assert runs @ costs == pytest.approx(found.fun, rel=1e-6)
    assert work(np.sqrt(0.94), 0.002) == pytest.approx(runs @ costs * 1e-3, rel=1e-9)
    assert optimal_runs(variances, costs, seconds=60.0) @ costs == pytest.approx(60.0)


def test_the_published_ratio_of_two_models():
    """Peherstorfer et al. (2016), (3.5): r = sqrt(w_1 rho^2 / (w_2 (1 - rho^2)))."""
    runs = optimal_runs(np.array([0.19, 0.81]), np.array([1.0, 0.01]), variance=1.0)
    assert runs[1] / runs[0] == pytest.approx(np.sqrt(0.81 / (0.01 * 0.19)))


def test_the_estimate_is_the_regression_line_at_the_mean_of_the_cheap_model():
    rng = np.random.default_rng(4)
    cheap = rng.standard_normal(500)
    exact = 2.0 + 0.7 * cheap[:40] + 0.1 * rng.standard_normal(40)
    slope, intercept = np.polyfit(cheap[:40], exact, 1)
    found = mean_of(exact, cheap[:, None], allowed=0.0)
    assert found.value == pytest.approx(intercept + slope * cheap.mean())
    assert found.residual == pytest.approx(np.sum((exact - intercept - slope * cheap[:40]) ** 2) / 38)
    assert found.explained == pytest.approx(slope**2 * cheap.var(ddof=1)) and found.freedom == 38
    alone = mean_of(exact, allowed=0.0)
    assert alone.value == exact.mean() and alone.variance == pytest.approx(exact.var(ddof=1) / 40)
    assert alone.half == pytest.approx(np.diff(t.interval(0.95, 39, scale=exact.std(ddof=1) / np.sqrt(40)))[0] / 2)


def test_two_controls_are_a_regression_on_both():
    """A force that is no line of the cheap force is one of force and displacement; what never varies is no control."""
    rng = np.random.default_rng(4)
    force, displacement = rng.random((2, 4000))
    cheap = np.stack([force, displacement, np.ones(4000)], axis=1)
    found = mean_of(1.0 + (2 * force - 3 * displacement)[:50], cheap)
    assert found.value == pytest.approx(1.0 + 2 * force.mean() - 3 * displacement.mean(), rel=1e-12)
    assert found.correlation == pytest.approx(1.0) and found.freedom == 47
    assert mean_of(1.0 + (2 * force - 3 * displacement)[:50], cheap[:, :1]).correlation < 0.8


def test_the_variance_is_that_of_repetitions():
    """The stated variance against that of two thousand estimates from 60 exact and 600 cheap draws."""
    rng, found = np.random.default_rng(3), []
    for _ in range(2000):
        hidden, other = rng.standard_normal((2, 600))
        cheap = 1.1 * np.exp(0.45 * hidden)
        found.append(mean_of(np.exp(SPREAD * (hidden + NOISE * other))[:60], cheap[:, None]))
    values = np.array([one.value for one in found])
    stated = np.mean([one.variance for one in found])  # with two draws more of the largest deviation
    assert 0.9 * values.var() < stated < 1.6 * values.var()
    assert values.mean() == pytest.approx(np.exp(truth() / 2), abs=0.003)


def test_an_event_that_no_run_shows_may_still_occur():
    """By Wilson (1927) the interval of no event in 100 runs reaches to q^2/(n + q^2)."""
    assert mean_of(np.zeros(100), share=True).interval == pytest.approx((0.0, 1.984**2 / (100 + 1.984**2)), abs=1e-5)


@pytest.mark.parametrize("chance", [0.02, 0.1, 0.5, 0.97])
def test_intervals_of_a_share_miss_on_both_sides_alike(chance):
    """Of all samples of 500 with their weights."""
    counts = np.arange(501)
    weights = binom.pmf(counts, 500, chance)
    ends = np.array([
        mean_of((np.arange(500) < count).astype(float), share=True).interval for count in counts[weights > 1e-9]
    ])  # fmt: skip
    below, above = ends[:, 1] < chance, ends[:, 0] > chance
    missed = [float(weights[weights > 1e-9] @ side) for side in (below, above)]
    assert 0.92 < 1 - sum(missed) < 0.98 and all(0.005 < each < 0.045 for each in missed)


def test_a_share_with_a_control_has_the_interval_of_more_draws():
    """As many as have its variance; of a control that says nothing, those of the exact runs, less the allowance."""
    rng = np.random.default_rng(2)
    hidden = rng.random(60_000)
    exact, cheap = (hidden < 0.1).astype(float), (hidden < 0.09).astype(float)
    alone, helped = mean_of(exact[:2000], share=True), mean_of(exact[:2000], cheap[:, None], share=True)
    assert alone.draws == pytest.approx(2000)
    assert helped.draws == pytest.approx(helped.plain / helped.variance) and helped.draws > 4 * alone.draws
    useless = mean_of(exact[:2000], rng.permutation(cheap)[:, None], share=True)
    assert 0.97 * 2000 < useless.draws < 2000 and useless.half == pytest.approx(alone.half, rel=0.02)


def smooth(rng, count):
    hidden, other = rng.standard_normal((2, count))
    return np.exp(SPREAD * (hidden + NOISE * other)), 1.1 * np.exp(0.45 * hidden)


def curved(rng, count):
    hidden, other = rng.standard_normal((2, count))
    return 2.0 + 0.5 * hidden + hidden**2 + 0.1 * other, hidden


def jumping(rng, count):
    """One draw in a hundred jumps by ten times the mean; the cheap model does not see it."""
    hidden, other = rng.standard_normal((2, count))
    return np.exp(0.3 * (hidden + 0.1 * other)) + 10 * (rng.random(count) < 0.01), np.exp(0.3 * hidden)


def stiffening(rng, count):
    """A rim at twice the median, met by one draw in 24, which the cheap model does not have."""
    hidden, other = rng.standard_normal((2, count))
    reached = np.exp(0.4 * (hidden + 0.1 * other))
    return reached + 20 * np.maximum(reached - 2.0, 0.0), np.exp(0.4 * hidden)


POPULATIONS = {"smooth": smooth, "curved": curved, "jumping": jumping, "stiffening": stiffening}
LIMIT = {"smooth": 2.0, "curved": 6.0, "jumping": 1.8, "stiffening": 2.0}  # of a probability


class Population(Lognormal):
    """Draws of one of the populations."""

    def __init__(self, draw, seed):
        super().__init__(seed, cost=0.05)
        exact, cheap = draw(np.random.default_rng([7, seed]), 60_000)
        self._values = {"exact": exact, "equivalent": cheap}
        self._early = np.zeros(len(exact), dtype=bool)


@pytest.mark.parametrize("name", POPULATIONS)
def test_intervals_of_a_pilot_hold_the_mean(name):
    """Of 400 intervals of 95 % by the runs of a pilot, 92 to 98 % hold it."""
    draw, held = POPULATIONS[name], 0
    expected = draw(np.random.default_rng(0), 1_000_000)[0].mean()
    for seed in range(400):
        exact, cheap = draw(np.random.default_rng([7, seed]), 4000)
        found = mean_of(exact[:PILOT], cheap[:, None])
        held += abs(found.value - expected) <= found.half
    assert 0.92 * 400 <= held <= 0.98 * 400


@pytest.mark.slow
@pytest.mark.parametrize("statistic", ["mean", "probability"])
@pytest.mark.parametrize("name", POPULATIONS)
def test_intervals_of_estimates_hold_the_truth(name, statistic):
    """Of whole estimates, whose rounds end when the interval is narrow enough."""
    draw, held = POPULATIONS[name], 0
    values = draw(np.random.default_rng(0), 4_000_000)[0]
    expected, threshold, target = values.mean(), None, 0.03
    if statistic == "probability":
        threshold, target = LIMIT[name], 0.01
        expected = np.mean(values >= threshold)
    for seed in range(400):
        found = estimated(Population(draw, seed), Question("q", statistic, threshold, target=target))
        held += found.interval[0] <= expected <= found.interval[1]
    assert 0.92 * 400 <= held <= 0.98 * 400


def test_a_jump_that_the_cheap_model_does_not_see_runs_plainly_and_says_so():
    found = estimated(Population(jumping, 1), Question("q", target=0.05))
    assert any("no cheaper model saves time" in note for note in found.notes)
    assert found.value == pytest.approx(np.exp(0.045 * 1.01) + 0.1, abs=2 * found.half)


def test_fewer_exact_runs_than_show_what_is_rare_are_stated():
    few = estimated(Lognormal(), Question("q", target=0.1, pilot=40))
    assert any("fewer than one draw in 10" in note for note in few.notes) and few.runs["exact"] < PILOT
    many = estimated(Lognormal(), Question("q", target=0.1))
    assert not many.notes and many.runs["exact"] == PILOT


CASES = {
    "mean": ("mean", None, 0.03, lambda: np.exp(truth() / 2), 3.0),
    "probability": ("probability", 2.0, 0.02, lambda: norm.sf(np.log(2.0) / np.sqrt(truth())), 2.0),
}
"""Statistic, threshold, target, true value, and the least saving in seconds: Wilson's interval asks for more runs."""


@pytest.mark.slow
@pytest.mark.parametrize("case", ["mean", pytest.param("probability", marks=pytest.mark.slow)])
def test_intervals_hold_the_truth(case):
    """Of a hundred intervals of 95 % at least 88 hold it (a chance of 0.4 % for fewer); exact runs are saved."""
    statistic, threshold, target, value, saving = CASES[case]
    held, gains = 0, []
    for seed in range(100):
        found = estimated(Lognormal(seed), Question("q", statistic, threshold, target=target, seed=seed))
        held += found.interval[0] <= value() <= found.interval[1]
        gains.append(found.plain_seconds / found.seconds)
    assert held >= 88 and np.median(gains) > saving


class Overshooting(Lognormal):
    """A cheap model that is right but for one draw in fifty, of which it makes a hundred times too much."""

    def __init__(self, seed):
        super().__init__(seed, cost=0.02)
        rng = np.random.default_rng([seed, 6])
        exact = np.exp(0.3 * rng.standard_normal(200_000))
        rare = rng.random(len(exact)) < 0.02
        close = exact * np.exp(0.01 * rng.standard_normal(len(exact)))
        self._values = {"exact": np.where(rare, 5 * exact, exact), "equivalent": np.where(rare, 500 * exact, close)}


def test_a_cheap_model_that_is_wrong_at_few_draws_misleads_nobody():
    """Those draws are beyond the exact runs of the pilot: an error, until some are among them."""
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


class Separating(Lognormal):
    """Both models end early at the same draws; the cheap one has a bias, and no such quantity, but a displacement."""

    def __init__(self, seed=0):
        super().__init__(seed, fails=0.1)
        cheap = 3.0 * self._values["exact"] ** 0.8
        self._values["equivalent"] = np.stack([np.full(len(cheap), np.inf), cheap], axis=1)

    def values(self, level, count):
        return super().values(level, count)[0], self._early[:count]


@pytest.mark.parametrize(("side", "threshold"), [("most", 2.0), ("least", 0.5)])
def test_a_cheap_model_exceeds_as_often_as_the_exact_one(side, threshold):
    """A biased displacement that rises with the quantity, or falls, tells all exceedances, and so do early ends."""
    source = Separating()
    if side == "least":
        source._values["exact"] = 1 / source._values["exact"]
        source._values["equivalent"][:, 0] = np.inf
    found = estimated(source, Question("q", "probability", threshold, target=0.01, side=side))
    beyond = np.mean((source._values["exact"] >= threshold) | source._early)
    expected = beyond if side == "most" else np.mean((source._values["exact"] >= threshold) & ~source._early)
    assert found.interval[0] <= expected <= found.interval[1]
    assert found.correlation["equivalent"] == pytest.approx(1.0) and found.plain_seconds > 3 * found.seconds


def test_a_matched_threshold_is_beyond_as_many_draws_as_the_exact_one_in_the_mean():
    """The smallest cheap exceedance as the limit would leave out one draw in 500 of the others: a tenth of 0.02."""
    chance, exact, cheap, shares = 0.02, 500, 20_000, []
    for seed in range(150):
        source = Lognormal(seed, population=cheap)
        source._values["exact"] = np.random.default_rng(seed).uniform(size=cheap)
        source._values["equivalent"] = 3.0 * source._values["exact"] ** 0.8
        state = _State(source, Question("q", "probability", 1.0 - chance, target=0.01))
        shares.append(state.controls("equivalent", cheap, source._values["exact"][:exact]).mean())
    assert np.mean(shares) == pytest.approx(chance, abs=4 * np.std(shares) / np.sqrt(len(shares)))


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


def small_study(**changes):
    table = tomllib.loads(example_text())
    table["records"] = {
        "motions": [
            {"bundled": f"ridgecrest-2019-ci-{name}", "components": ["E1"], "duration": 10.0} for name in ("ccc", "clc")
        ],
        "scales": [0.5, 1.0, 1.5],
    }
    return {**table, "keep": ["peak_displacement", "peak_force", "minimum_gap"], **changes}


@pytest.mark.slow
def test_an_estimate_of_a_study_is_kept_and_continued(tmp_path):
    accuracy = {"quantity": "peak_displacement", "target": "80 %", "pilot": 16, "models": ["equivalent"]}
    table = small_study(accuracy=accuracy)
    first = estimate(table, tmp_path / "out", workers=1)
    rows = read_study(tmp_path / "out")
    assert len(rows) == first.runs["exact"] >= 16 and "peak_force" in rows.columns
    assert (tmp_path / "out" / "equivalent" / "study.toml").is_file() and first.correlation["equivalent"] > 0.8
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("part-*")}
    again = estimate(table, tmp_path / "out", workers=1)
    assert again.value == first.value and again.interval == first.interval
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("part-*")} == times
    tighter = estimate(table, tmp_path / "out", target="30 %", workers=1)
    assert tighter.runs["exact"] >= first.runs["exact"] and tighter.half < first.half
    assert len(estimate_table(tighter).rows) <= 10
    plot_estimate(tighter, tmp_path / "e.png")
    assert (tmp_path / "e.png").stat().st_size > 10_000


BAD = {
    "no goal": ({}, "give target, such as '2 %', or budget"),
    "no quantity": ({"target": "2 %"}, "accuracy.quantity is missing"),
    "unknown quantity": ({"quantity": "peak_force_ratio", "target": 0.1}, "the study keeps"),
    "threshold": ({"quantity": "peak_force", "statistic": "probability", "target": 0.1}, "accuracy.threshold"),
    "text": ({"quantity": "peak_force", "target": "two"}, "accuracy.target = 'two'"),
    "statistic": ({"quantity": "peak_force", "statistic": "quantile", "threshold": 0.5, "target": 0.1}, "statistic"),
    "models": ({"quantity": "peak_force", "target": 0.1, "models": ["cheap"]}, "accuracy.models has 'cheap'"),
    "no such model": ({"quantity": "peak_force", "target": 0.1, "models": ["rigid"]}, "one bearing has no such model"),
    "key": ({"quantity": "peak_force", "goal": 0.1}, "accuracy.goal: no such key"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_writes_nothing(tmp_path, case):
    accuracy, text = BAD[case]
    table = small_study(accuracy=accuracy)
    with pytest.raises(InputError, match=text) as error:
        estimate(table, tmp_path / "out")
    assert "\n" not in str(error.value) and not (tmp_path / "out").exists()


def test_a_target_beyond_the_budget_leaves_no_folder(tmp_path):
    """Its pilot is needed to know; a folder that was there before keeps its runs."""
    goal = {"quantity": "peak_displacement", "target": "0.01 %", "pilot": 16, "budget": "1 s", "models": ["equivalent"]}
    with pytest.raises(InputError, match="budget = 1 s: give a target of") as error:
        estimate(small_study(accuracy=goal), tmp_path / "out")
    assert "\n" not in str(error.value) and not (tmp_path / "out").exists()


@pytest.mark.slow
def test_an_estimate_on_dask_has_the_same_runs(tmp_path):
    distributed = pytest.importorskip("distributed")
    table = small_study(accuracy={"quantity": "peak_displacement", "target": "30 %", "pilot": 16})
    local = estimate(table, tmp_path / "threads", workers=2)
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
    found = estimate(table, tmp_path / "out", "peak_force", target=0.5, pilot=16, models=["equivalent"], workers=1)
    assert found.interval[0] < found.value < found.interval[1] and found.correlation["equivalent"] > 0.8
