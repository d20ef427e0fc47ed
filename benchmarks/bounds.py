"""Draw the figure of docs/bounding.md: `python benchmarks/bounds.py`."""

from __future__ import annotations

from pathlib import Path

from msfp_gen import load_scene
from msfp_gen.studies.bounding import bound, load_factors
from msfp_gen.studies.bounding.figure import plot_bounds

FIGURE = Path(__file__).resolve().parents[1] / "docs" / "figures" / "fenz-test5-bounds.png"

if __name__ == "__main__":
    plot_bounds(bound(load_scene("fenz-test5"), load_factors("asce7")), FIGURE)
