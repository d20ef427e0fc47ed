"""Search for designs: the front of a known problem, limits, runs that end early, and continuing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.study_tables import cheap_study

from msfp_gen import InputError
from msfp_gen.cli import main
from msfp_gen.scene.file.loader import dumps
from msfp_gen.studies import Goals, pareto
from msfp_gen.studies.assessment import pareto as module
from msfp_gen.studies.assessment.pareto import not_dominated

SEARCH: dict[str, Any] = {"population": 12, "generations": 4, "seed": 1, "threads": True}


def schaffer(**changes: Any) -> dict[str, Any]:
    """Schaffer's problem: minimise x^2 and (x - 2)^2, whose front is 0 <= x <= 2; the runs themselves do not matter."""
    axes = {
        "case": {"values": [0.5, 1.0]},
        "x": {"distribution": "uniform", "low": -3.0, "high": 5.0},
    }
    quantities = {"f": "case * x**2", "g": "case * (x - 2)**2", "h": "x"}
    return cheap_study(axes=axes, quantities=quantities, sampling=None, chunk=None, keep=[], **changes)


def test_the_front_of_a_known_problem_is_found(tmp_path: Path) -> None:
    pytest.importorskip("pymoo")
    found = pareto(schaffer(), tmp_path, Goals(("f", "g")), **SEARCH)
    designs = found.designs
    assert len(designs) == 48 and designs.feasible.all()
    np.testing.assert_allclose(designs.f, designs.x**2, rtol=1e-12)  # the larger of both cases
    front = designs[designs.front]
    assert len(front) >= 10 and front.x.between(-0.2, 2.2).all()
    assert designs[designs.generation == 4].x.between(-0.5, 2.5).mean() > 0.9  # of the first: 3/8
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "designs.parquet"), designs, check_dtype=False)


def test_a_search_continues_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pymoo")
    whole = pareto(schaffer(), tmp_path / "a", Goals(("f", "g")), **SEARCH)
    pareto(schaffer(), tmp_path / "b", Goals(("f", "g")), **{**SEARCH, "generations": 2})
    computed: list[Any] = []
    run_on = module.run_on
    monkeypatch.setattr(module, "run_on", lambda *arguments: computed.append(run_on(*arguments)))
    again = pareto(schaffer(), tmp_path / "b", Goals(("f", "g")), **SEARCH)
    assert [done.done for done in computed] == [0, 0, 24, 24]
    pd.testing.assert_frame_equal(again.designs, whole.designs)


def test_limits_and_early_ends_bound_the_front(tmp_path: Path) -> None:
    """Designs above the limit are not feasible, nor are those whose runs ended early."""
    pytest.importorskip("pymoo")
    goals = Goals(("f",), ("h",), {"h": 1.0})
    found = pareto(schaffer(), tmp_path / "a", goals, **SEARCH).designs
    assert not found[found.h > 1].feasible.any() and found[found.h <= 1].feasible.all()
    assert 0.5 < found[found.front].h.max() <= 1
    axes = {"x": {"sets": "stop.displacement", "distribution": "uniform", "low": 2e-4, "high": 2e-3}}
    table = schaffer() | {"axes": axes, "quantities": {"f": "x * 1", "g": "1 / x"}}
    stops = pareto(table, tmp_path / "b", Goals(("f", "g")), **SEARCH).designs
    # The base moves 1.2 mm, the bearing a little less, since the rig gives way.
    assert stops[stops.x > 1.2e-3].feasible.all() and not stops[stops.x < 1.1e-3].feasible.any()
    assert 0 < stops.feasible.sum() < 48 and stops[stops.front].x.min() > 1.1e-3


def test_a_row_is_dominated_by_one_that_is_better_in_all() -> None:
    values = np.array([[1, 3], [2, 2], [3, 1], [2, 3], [1, 3], [np.inf, 0]])
    assert not_dominated(values).tolist() == [True, True, True, False, True, True]


def test_bad_goals_are_named_and_nothing_is_written(tmp_path: Path) -> None:
    pytest.importorskip("pymoo")
    cases: list[tuple[Goals, dict[str, Any], str]] = [
        (Goals(("f",)), {}, "pareto: give two or more different quantities"),
        (Goals(("f", "gg")), {}, "gg: no column of this study; did you mean 'g'"),
        (Goals(("f", "g"), (), {"k": 1.0}), {}, "k: no column"),
        (Goals(("f", "g"), statistic="mode"), {}, "statistic = 'mode'"),
        (Goals(("f", "g")), {"population": 2}, "population = 2: give 4 or more"),
    ]
    for goals, change, message in cases:
        with pytest.raises(InputError, match=message):
            pareto(schaffer(), tmp_path / "out", goals, **{**SEARCH, **change})
    with pytest.raises(InputError, match="axes: none has a distribution"):
        pareto(cheap_study(axes={}, sampling=None), tmp_path / "out", Goals(("f", "g")), **SEARCH)
    assert not (tmp_path / "out").exists()


def test_the_command_prints_and_draws_the_front(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pymoo")
    path, figure = tmp_path / "study.toml", tmp_path / "front.png"
    path.write_text(dumps(schaffer()), encoding="utf-8")
    place = ["study", "pareto", str(path), "-o", str(tmp_path / "out"), "--minimise", "f", "--minimise", "g"]
    numbers = ["--population", "12", "--generations", "2", "--threads"]
    assert main([*place, *numbers, "--plot", str(figure)]) == 0
    shown = capsys.readouterr().out
    assert "on the Pareto front, of 24 feasible ones among 24" in shown and figure.stat().st_size > 5000
    assert main([*place, *numbers, "--json"]) == 0
    assert all(-1 < design["x"] < 3 for design in json.loads(capsys.readouterr().out))
    assert main([*place, "--at-most", "f"]) == 2 and "--at-most = 'f': give a column" in capsys.readouterr().err
