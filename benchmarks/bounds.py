"""Draw the figure of docs/properties.md: `python benchmarks/bounds.py`."""

from __future__ import annotations

from quick import docs_folder, parser

from msfp_gen import load_scene
from msfp_gen.studies.bounding import bound, load_factors
from msfp_gen.studies.bounding.runs import plot_bounds

if __name__ == "__main__":
    parser(__doc__).parse_args()
    figure = docs_folder() / "figures" / "fenz-test5-bounds.png"
    plot_bounds(bound(load_scene("fenz-test5"), load_factors("asce7")), figure)
