"""Settings of sphinx-gallery: the order of the examples, figures that are not of pyplot, and text for thumbnails."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
from cycler import cycler
from sphinx_gallery.scrapers import figure_rst

from msfp_gen.figures.style import COLOURS, PALE

ORDER = (
    "own_bearing", "data_sheet", "five_regimes", "friction_and_heat", "orbit", "record", "rims", "uplift",
    "tests_to_friction", "bounds", "fragility", "design_by_gradient", "pareto", "sensitivity",
    "hospital", "torsion", "floor_spectra",
    "stiffness", "own_integrator",
    "audit", "opensees",
)  # fmt: skip
STYLE: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.constrained_layout.use": True,
    "figure.figsize": (6.0, 4.2),
    "font.size": 18,
    "grid.color": PALE,
    "legend.fontsize": 16,
    "legend.frameon": False,
    "lines.linewidth": 3.0,
}


class Order:
    """Key of an example in its section."""

    def __init__(self, folder: str) -> None:
        pass

    def __call__(self, name: str) -> int:
        """Place in ORDER of the file of this name."""
        return ORDER.index(Path(name).stem)


def figures(_: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """The image of what a block of an example leaves as `figure`, unless pyplot has it."""
    figure = variables["example_globals"].pop("figure", None)
    if figure is None or hasattr(figure, "number"):
        return ""
    path = next(variables["image_path_iterator"])
    figure.savefig(path, dpi=110, bbox_inches="tight")
    return str(figure_rst([path], configuration["src_dir"]))


def style(*_: Any) -> None:
    """Figures that an example draws by pyplot can be read as thumbnails."""
    matplotlib.rcParams.update(STYLE)
