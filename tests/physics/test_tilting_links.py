"""A two-port in two directions against a chain of tilting links, which is exact for small tilts."""

from __future__ import annotations

import numpy as np
import pytest
from support import Array, links

from msfp_gen import Top, TwoPort


def served(path: Array, yielding: float) -> Array:
    """Horizontal forces of the upper end, shape (rows, 2) [N]."""
    port = TwoPort(links.shallow(yielding), Top.node(1e7, 100.0, 1e6), links.WEIGHT)
    still, upper, found = np.zeros((3, 6)), np.zeros((3, 6)), []
    for time, row in enumerate(path, start=1):
        upper[0, :2] = row
        found.append(port.trial(float(time), still, upper).wrench[1, :2])
        port.commit()
    return np.array(found)


@pytest.mark.parametrize(("amplitude", "accuracy"), [(0.2, 3e-3), (0.29, 0.012)])
def test_nested_surfaces_slide_as_a_stack_of_bodies(amplitude: float, accuracy: float) -> None:
    """The larger path meets rims. A series of links, each with friction for itself, differs by more."""
    path = links.eight(amplitude, 100)
    found, expected = served(path, 1e-4), links.stack(path, links.FRICTIONS, 1e-4)
    largest = np.abs(expected).max()
    assert np.abs(found - expected).max() < accuracy * largest
    series = links.series(path, links.beginning(links.FRICTIONS), 1e-4, parts=5)
    assert np.abs(found - series)[1:].max() > 0.02 * largest


@pytest.mark.slow
def test_stack_and_series_differ_by_the_friction_of_the_inner_surfaces() -> None:
    path, found = links.eight(0.2, 100), []
    for inner in (0.004, 0.002, 0.0002):
        frictions = [inner, *links.FRICTIONS[1:]]
        stack = links.stack(path, frictions, 1e-4)
        series = links.series(path, links.beginning(frictions), 3e-3 * inner, parts=5)
        found.append(np.abs(stack - series).max() / np.abs(stack).max())
    assert found == pytest.approx([0.049, 0.027, 0.0034], rel=0.05)
