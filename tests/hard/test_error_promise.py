"""What `--error` states is at least the true error: random scenes of `benchmarks/promises.py` (docs/accuracy.md)."""

from __future__ import annotations

import auto_scenes
import promises
import pytest
from support import thinned

from msfp_gen import RunError

KEPT = {14, 16}  # planar rigs on one layout, with and without heat


@pytest.mark.parametrize("number", thinned(range(promises.COUNT), lambda number: number in KEPT))
def test_the_stated_error_holds(number: int) -> None:
    """Against a run with all effects for which the scene has parameters."""
    scene = auto_scenes.demanding(promises.SEED, number)
    try:
        found = promises.promise(scene.name, scene)
    except RunError as error:
        assert error.status == "accuracy", error
        return
    assert found.kept, found
