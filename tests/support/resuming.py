"""Runs that are interrupted, and the comparison of two results bit by bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from msfp_gen import RunError, Scene, simulate
from msfp_gen.results.result import Result


def stopping_at(when: float) -> Any:
    def progress(t: float, _: float) -> None:
        if t >= when:
            raise KeyboardInterrupt

    return progress


def interrupted(scene: Scene, path: Path, when: float, **options: Any) -> Result:
    with pytest.raises(RunError) as caught:
        simulate(scene, progress=stopping_at(when), checkpoint=path, **options)
    assert caught.value.status == "interrupted" and caught.value.exit_code == 130
    assert isinstance(caught.value.result, Result)
    return caught.value.result


def assert_same(one: Result, two: Result) -> None:
    """Every number of two results, bit by bit; only the time on the clock may differ."""
    for name, values in vars(one.history).items():
        pairs = values.items() if isinstance(values, dict) else [("", values)]
        for key, array in pairs:
            other = getattr(two.history, name)
            assert np.array_equal(array, other[key] if key else other), (name, key)
    for left, right in zip(one.events, two.events, strict=True):
        assert all(np.array_equal(getattr(left, key), value) for key, value in vars(right).items())
    assert replace(one.counters, wall_time=0.0) == replace(two.counters, wall_time=0.0)
    assert (one.status, one.message) == (two.status, two.message)
