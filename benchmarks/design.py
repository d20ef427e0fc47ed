"""The optimum of the example design_by_gradient against a scan, from other starts, and by finite differences.

Usage: python benchmarks/design.py [scan] [search]; five minutes; prints the table of docs/gradients.md, draws its figure.
"""

from __future__ import annotations

import runpy
import time
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from quick import docs_folder, parser, pick
from scipy.optimize import minimize

from msfp_gen import simulate_batch
from msfp_gen.common.arrays import Array
from msfp_gen.figures.style import COLOURS, INK, page

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "gallery" / "design" / "design_by_gradient.py"
STARTS = pick(((0.08, 0.946), (0.06, 0.7), (0.11, 0.9), (0.095, 1.5)), ((0.08, 0.946),))
WHOLE = np.arange(0.055, 0.1151, pick(0.005, 0.05)), np.arange(0.7, 1.801, pick(0.1, 0.5))  # friction, radius [m]
STEPS, AROUND = (0.0005, 0.01), pick(3, 1)  # of the scan about the optimum, and their number to each side
BATCH = 100  # runs at the same time; rows of more would fill the memory


def example() -> dict[str, Any]:
    """Names of the example after it has run."""
    matplotlib.use("agg")
    return runpy.run_path(str(EXAMPLE))


def scanned(names: dict[str, Any], friction: Array, radius: Array) -> Array:
    """Displacement [m] and shear of every design: shape (friction, radius, record, quantity)."""
    scenes = [
        names["changed"](each, f, r) for f in friction.tolist() for r in radius.tolist() for each in names["scenes"]
    ]
    found = []
    for begin in range(0, len(scenes), BATCH):
        runs = simulate_batch(scenes[begin : begin + BATCH])
        for run in runs:  # one that fails hits its rims hard, far beyond the limit
            numbers = run.summary["peak_displacement"]["radial"], run.summary["peak_force_ratio"]
            assert run.succeeded or numbers[0] > names["LIMIT"], run.message
            found.append(numbers if run.succeeded else (np.inf, np.inf))
    return np.array(found).reshape(len(friction), len(radius), len(names["scenes"]), 2)


def best(names: dict[str, Any], friction: Array, radius: Array, found: Array) -> str:
    """The permissible design of a scan with the least shear, as cells of a table."""
    shear = np.where((found[..., 0] <= names["LIMIT"]).all(axis=2), found[..., 1].max(axis=2), np.inf)
    i, j = np.unravel_index(shear.argmin(), shear.shape)
    failed = np.isinf(found[..., 0]).sum()
    cost = f"{2 * shear.size} runs{f', {failed} of them failed' if failed else ''}"
    return f"{friction[i]:.4f} | {radius[j]:.3f} | {shear[i, j]:.4f} | {cost}"


def by_differences(names: dict[str, Any]) -> str:
    """The search from the first start with differences of SciPy, which need no derivatives; cells of a table."""
    runs = 0

    def margins(x: Array) -> Array:
        nonlocal runs
        friction, radius = (x * names["UNIT"])[:2].tolist()
        found = simulate_batch([names["changed"](each, friction, radius) for each in names["scenes"]])
        runs += len(found)
        displacement = np.array([run.summary["peak_displacement"]["radial"] for run in found])
        shear = np.array([run.summary["peak_force_ratio"] for run in found])
        return np.concatenate([1 - displacement / names["LIMIT"], x[2] - shear / names["UNIT"][2]])

    start = np.array([*STARTS[0], 0.2]) / names["UNIT"]
    bounds = [(0.5, 1.2), (0.6, 1.8), (0.0, 5.0)]
    constraints = {"type": "ineq", "fun": margins}
    found = minimize(
        lambda x: x[2],
        start,
        constraints=constraints,
        bounds=bounds,
        method="SLSQP",
        options={"ftol": 1e-6, "maxiter": pick(100, 1)},
    )
    friction, radius, shear = found.x * names["UNIT"]
    return f"{friction:.4f} | {radius:.3f} | {shear:.4f} | {runs} runs"


def draw(names: dict[str, Any], found: Array, path: Array) -> None:
    """Shear over all designs, the limit of both displacements, and the way of the search."""
    with page(7.4, 5.0, docs_folder() / "figures" / "design.png") as figure:
        axes = figure.subplots()
        friction, radius = WHOLE
        field = axes.contourf(
            friction, radius, found[..., 1].max(axis=2).T, np.arange(0.14, 0.321, 0.01), cmap="Greys", extend="both"
        )
        figure.colorbar(field, label="largest shear over the weight")
        for index, (name, colour) in enumerate(zip(names["RECORDS"], COLOURS, strict=False)):
            axes.contour(friction, radius, np.minimum(found[:, :, index, 0], 1.0).T, [names["LIMIT"]], colors=colour)
            axes.plot([], [], color=colour, label=f"{name}: {1e3 * names['LIMIT']:.0f} mm; permissible below and right")
        axes.plot(*path.T, "o-", color=INK, markersize=4, linewidth=1, label="search")
        axes.plot(*path[-1], "*", color=COLOURS[4], markersize=13, markeredgecolor=INK, label="optimum")
        axes.set(xlabel="friction of the outer surfaces", ylabel="their radius [m]")
        axes.grid(visible=False)
        axes.legend(loc="upper left", framealpha=0.9, frameon=True)


def search(names: dict[str, Any]) -> None:
    """Print a row for the search from every start, and by finite differences; CPU time over that of the first."""
    whole = 0.0
    for start in STARTS:
        names["responses"].cache_clear()
        names["path"].clear()
        clock = time.process_time()
        found = names["design"](*start)
        taken = time.process_time() - clock
        whole = whole or taken
        friction, radius, shear = found.x * names["UNIT"]
        runs = 2 * names["responses"].cache_info().misses
        cells = f"{friction:.4f} | {radius:.3f} | {shear:.4f} | {runs} runs with derivatives"
        print(f"| from {start[0]:g}, {start[1]:g} m | {cells} | {taken / whole:.1f} |", flush=True)
    clock = time.process_time()
    cells = by_differences(names)
    name = f"from {STARTS[0][0]:g}, {STARTS[0][1]:g} m, differences"
    print(f"| {name} | {cells} | {(time.process_time() - clock) / whole:.1f} |", flush=True)


def scan(names: dict[str, Any]) -> None:
    """Print the best designs of two scans, and draw the first."""
    path = np.array(names["path"])
    near = [step * (np.arange(-AROUND, AROUND + 1) + round(x / step)) for x, step in zip(path[-1], STEPS, strict=True)]
    print(f"| scan about the optimum | {best(names, *near, scanned(names, *near))} | - |", flush=True)
    everything = scanned(names, *WHOLE)
    print(f"| scan of all designs | {best(names, *WHOLE, everything)} | - |", flush=True)
    draw(names, everything, path)


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("parts", nargs="*", metavar="PART", help="scan, search; default: both")
    given = options.parse_args()
    loaded = example()  # with the search from the first start
    print("| search | friction | radius [m] | shear | cost | CPU time |\n|---|---|---|---|---|---|")
    for part in given.parts or ("scan", "search"):
        {"scan": scan, "search": search}[part](loaded)
