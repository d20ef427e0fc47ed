"""What `Auto` leaves out stays within its promise: the scenes of `benchmarks/auto.py`, tables in docs/effects.md."""

from __future__ import annotations

from itertools import islice

import auto
import auto_scenes
import pytest
from support import thinned

from msfp_gen import RunError, Scene

NAMED = 17  # number of named scenes
# In these a slider on its edge, or a jam, brings uplift in during the run, which the promise excludes.
TAKEN_LATE = {("scene", 2), ("scene", 5), ("slow_test", 42)}
KINDS = {kind.__name__: kind for kind in auto_scenes.KINDS}
CASES = [("named", number) for number in range(NAMED)]
CASES += [(kind, number) for kind in KINDS for number in range(auto.COUNT)]
KEPT = {("named", 10), ("slow_test", 18), ("slow_test", 33)}  # triple pendulums, massless; two under varying load


def scene_of_case(kind: str, number: int) -> Scene:
    """A named or a random scene."""
    return KINDS[kind](auto.SEED, number) if kind in KINDS else next(islice(auto.named(), number, None))


@pytest.mark.parametrize(("kind", "number"), thinned(CASES, lambda *case: case in KEPT))
def test_auto_keeps_its_promise(kind: str, number: int) -> None:
    found = auto.compare(scene_of_case(kind, number))
    if (kind, number) in KEPT:
        assert "inertia" in auto.left_out(found)
    if (kind, number) in TAKEN_LATE:
        assert "uplift" in auto.left_out(found)
    else:
        assert found.kept, (found.difference, found.floor)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(16))
def test_auto_follows_sliders_on_their_edges(number: int) -> None:
    """Within the promise; where the stack comes apart it does so at the same time."""
    scene = auto_scenes.on_edge(auto.SEED, number)
    try:
        found = auto.compare(scene)
    except RunError:
        when, end = auto.parted(scene)
        assert when == pytest.approx(end, rel=0.01)
        return
    assert found.kept, (found.difference, found.floor)
    if number in (0, 7, 10):
        assert "uplift" in auto.left_out(found)


@pytest.mark.slow
def test_all_named_scenes_are_compared() -> None:
    assert len(list(auto.named())) == NAMED
