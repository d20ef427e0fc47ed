"""Four friction coefficients fitted to the experiment in Table 4.2 of PEER 2017/07, with exact derivatives.

The data are the six printed numbers of the column "Experimental": displacements at which the sliding regimes of a
monotonic push change, and forces at the first contacts of rims 1 and 4. Nothing else is changed from Appendix A.
Usage: python benchmarks/fit_table.py; a minute; prints the tables of docs/properties.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from quick import parser, pick
from results_page import TABLE_42
from scipy.optimize import least_squares

from msfp_gen import Scene, load_scene, simulate
from msfp_gen.common.arrays import Array
from msfp_gen.results.result import Result
from msfp_gen.results.summary import RIMS, STOPS, stopping_displacement, transitions
from msfp_gen.studies.calibration.intervals import Noise, identified, spread_of, weak

LOAD = 112e3  # axial load of the preset [N]
SMALL = 1e-7  # change of a coefficient in which rows are linear
PATHS = ["bearing.friction[*]"]
PRINTED = np.array([row[2] * (1e-3 if key.startswith("u") else 1.0) for key, row in TABLE_42.items()])
# A residual is over the largest number of its kind: the last printed digit is then 0.8 % and 0.4 %.
LARGEST = np.array([PRINTED[3]] * 4 + [PRINTED[5]] * 2)


def push(friction: Array) -> Scene:
    """The monotonic push of the preset with these coefficients, shape (4,), damped contacts and no stop."""
    scene = load_scene("fenz-monotonic")
    bearing = scene.bearing.replace(friction=friction.tolist(), contact_damping=1e-4)
    return replace(
        scene, bearing=bearing, stop=None, duration=1.67, output_step=5e-4, solver=replace(scene.solver, rtol=1e-5)
    )


def computed(result: Result) -> Array:
    """The numbers of Table 4.2 of a run, shape (6,), [m] and over the axial load."""
    found = transitions(result)
    return np.array([found[key] for key in TABLE_42], dtype=float)


def derivatives(result: Result) -> Array:
    """Their derivatives with respect to the coefficients, shape (6, 4)."""
    assert result.gradients is not None
    slopes, found = result.gradients.arrays, []
    for index in range(4):

        def moved(change: float, index: int = index) -> Array:
            fields = ("base_displacement", "top_displacement", "sliding")
            rows = {name: getattr(result.history, name) + change * slopes[name][index] for name in fields}
            return np.array(
                [stopping_displacement(replace(result.history, **rows), at) for at in STOPS.values()], float
            )

        events = [
            next(i for i, e in enumerate(result.events) if e.kind == "rim_contact" and e.surface == rim) for rim in RIMS
        ]
        found.append(
            np.concatenate(
                [
                    (moved(SMALL) - moved(-SMALL)) / (2 * SMALL),
                    slopes["event_displacement"][index, events, 0],
                    slopes["event_top_force"][index, events, 0] / LOAD,
                ]
            )
        )
    return np.array(found).T


def fitted(names: Sequence[str], free: Sequence[int]) -> Array:
    """Fit the coefficients of some surfaces (0..3) and print the estimates; returns the numbers of Table 4.2."""
    sheet, where = load_scene("fenz-monotonic").bearing.arrays()["friction"], list(free)

    def friction(x: Array) -> Array:
        changed = sheet.copy()
        changed[where] = x
        return changed

    start = sheet[where]
    found = least_squares(
        lambda x: (computed(simulate(push(friction(x)))) - PRINTED) / LARGEST,
        start,
        lambda x: derivatives(simulate(push(friction(x)), gradients=PATHS))[:, where] / LARGEST[:, None],
        bounds=(0.1 * start, 10 * start),
        x_scale=start,
        xtol=1e-4,
        ftol=1e-4,
        max_nfev=pick(None, 2),
    )
    freedom = len(PRINTED) - len(free)
    known = identified(found.jac * found.x, names)
    spread = spread_of(known, [Noise(2 * found.cost / freedom, np.eye(1, len(PRINTED))[0], freedom)])
    deviation, half = spread.deviation * found.x, spread.half * found.x
    print("| coefficient | Appendix A | fitted | standard deviation | 95 % interval |\n|---|---|---|---|---|")
    for name, begin, value, error, width in zip(names, start, found.x, deviation, half, strict=True):
        print(f"| {name} | {begin:g} | {value:.4f} | {error:.4f} | {value - width:.3f} to {value + width:.3f} |")
    print(f"\ncondition {known.condition:.3g}; root mean square of the residuals {percent(found.fun)}")
    print(*known.lines, *weak(names, found.x, half, spread.correlation), "", sep="\n")
    return computed(simulate(push(friction(found.x))))


def percent(residual: Array) -> str:
    return f"{100 * np.sqrt(np.mean(residual**2)):.2g} %"


if __name__ == "__main__":
    parser(__doc__).parse_args()
    given = computed(simulate(push(load_scene("fenz-monotonic").bearing.arrays()["friction"])))
    four = fitted(("surface 1", "surface 2", "surface 3", "surface 4"), range(4))
    two = fitted(("surface 1", "surface 4"), (0, 3))
    print(f"Root mean square of the residuals with Appendix A: {percent((given - PRINTED) / LARGEST)}\n")
    print("|  | experiment | Appendix A | residual | four fitted | residual | two fitted | residual |")
    print("|---|---|---|---|---|---|---|---|")
    for (key, row), measured, *numbers in zip(TABLE_42.items(), PRINTED, given, four, two, strict=True):
        scale, digits = (1e3, 1) if key.startswith("u") else (1.0, 3)
        cells = [f"{scale * n:.{digits}f} | {scale * (n - measured):+.{digits}f}" for n in numbers]
        print(f"| {row[0]} | {scale * measured:.{digits}f} | {' | '.join(cells)} |")
