"""Figure 4.3 of PEER 2017/07: V(eta), the influence of the axial load on the motion inside the bearing: (4.1), (4.2).

The ground moves as u_g1 = 0.05 t^2 until 140 mm across the bearing; d = (delta_1 .. delta_4) over ground displacement
is compared with the same run at 1 MN. eta = N / W, where W = 90.64 N is the weight of the bearing without its base.

PEER 2017/07 does not state the rig. With one rig for all loads V would measure the rig: at 1 MN its springs deform and
the top plate tilts by 0.1 rad, at 1 N they are rigid. Therefore springs, dampers and rims are scaled here with the
vertical load on the lowest surface, N + W, from the values of fenz-monotonic at 112 kN. A bearing without mass and weight
would then have the same motion under every load, so V is due to the mass of the bearing alone. Two more series are the
same without inertia (sliders = "massless": weights only), and one rig for all loads.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from drawing import COLOURS, FAINT, INK, MILLI, Array, drawn, panels, tilts
from quick import docs_folder, parser, pick

from msfp_gen import RunError, Scene, Top, presets, simulate
from msfp_gen.common.output import replacing
from msfp_gen.results.result import Result
from msfp_gen.scene.scene_fields import Stop

WEIGHT = 9.24 * 9.81  # W [N] of PEER 2017/07, bodies 2..5
LARGEST, TESTED, U_MAX = 1e6, 112e3, 0.140  # N_max [N], N of table 4.1 [N], [m]
LOADS = np.geomspace(LARGEST, 1.0, pick(25, 3))
GRID = np.linspace(0.0, U_MAX, 14_001)  # ground displacements [m]
RTOL = 1e-6  # surfaces at yield accumulate small vibrations: runs at looser tolerances differ in the third digit of V


@dataclass(frozen=True)
class Series:
    """One series: whether the rig is scaled with the load, and whether the bodies have inertia."""

    name: str
    label: str
    scaled: bool = True
    sliders: Literal["inertial", "massless"] = "inertial"


SERIES = (
    Series("inertial", "inertia and weight"),
    Series("weights", "weight alone (massless sliders)", sliders="massless"),
    Series("fixed-rig", "one rig for all loads", scaled=False),
)


@dataclass(frozen=True)
class Point:
    """One run of the study.

    Attributes:
        series: name of the series.
        load: axial load [N].
        variance: V(eta); None if the run failed.
        reached: last ground displacement [m].
        status: of the run.
        time: last time [s].
    """

    series: str
    load: float
    variance: float | None
    reached: float
    status: str
    time: float

    @property
    def eta(self) -> float:
        return self.load / WEIGHT


def scene(load: float, series: Series) -> Scene:
    """fenz-monotonic under another axial load [N]."""
    base = presets.scene("fenz-monotonic")
    factor = (load + WEIGHT) / (TESTED + WEIGHT) if series.scaled else 1.0
    surfaces = [
        replace(s, rim_stiffness=factor * s.rim_stiffness, rim_damping=factor * s.rim_damping)
        for s in base.bearing.surfaces
    ]
    rig = {
        name: factor * getattr(base.top, name)
        for name in ("stiffness", "damping", "rotational_stiffness", "rotational_damping")
    }
    return replace(
        base,
        bearing=replace(base.bearing, surfaces=tuple(surfaces)),
        top=Top.rig(axial_load=load, **rig),
        effects=replace(base.effects, sliders=series.sliders),
        solver=replace(base.solver, rtol=RTOL),
        stop=Stop(displacement=U_MAX),
        motion_table=None,
    )


def attempt(scene: Scene) -> Result:
    """The run; of a failed run what was computed, with its status."""
    try:
        return simulate(scene)
    except RunError as error:
        assert isinstance(error.result, Result)
        return error.result


def path(result: Result) -> Array:
    """d over the ground displacements of GRID, ndarray, shape (len(GRID), 4), [rad] (4.2)."""
    ground = result.history.base_displacement[:, 0]
    return np.stack([np.interp(GRID, ground, delta) for delta in tilts(result).T], axis=1)


def variance(d: Array, reference: Array) -> float:
    """V of (4.1)."""
    squares = [np.trapezoid((x**2).sum(axis=1), GRID) for x in (d - reference, reference)]
    return float(np.sqrt(squares[0] / squares[1]))


def study(loads: Array = LOADS, series: tuple[Series, ...] = SERIES) -> list[Point]:
    """Run every load [N] of every series; the first load of each is the reference, which must succeed."""
    points = []
    for each in series:
        reference = path(simulate(scene(loads[0], each)))
        for load in loads:
            result = attempt(scene(load, each))
            v = variance(path(result), reference) if result.succeeded else None
            rows = result.history
            points.append(
                Point(
                    each.name, float(load), v, float(rows.base_displacement[-1, 0]), result.status, float(rows.time[-1])
                )
            )
    return points


def failures(points: list[Point]) -> list[Point]:
    return [point for point in points if point.variance is None]


def write(points: list[Point], folder: Path) -> None:
    """Write inertia-study.csv and inertia-study.png to `folder`."""
    with replacing(folder / "inertia-study.csv") as temporary, temporary.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["series", "N [N]", "eta", "V", "status", "ground displacement reached [mm]", "time [s]"])
        for p in points:
            v = "" if p.variance is None else f"{p.variance:.6g}"
            table.writerow(
                [p.series, f"{p.load:.6g}", f"{p.eta:.6g}", v, p.status, f"{p.reached * MILLI:.4f}", f"{p.time:.6f}"]
            )
    draw(points, folder / "inertia-study.png")


def draw(points: list[Point], path: Path) -> None:
    """Draw V over eta; runs that failed are crosses on the axis."""
    with drawn(path, 8, 4.8) as figure:
        (axes,) = panels(figure, "Difference from the run at 1 MN")
        for series, colour in zip(SERIES, COLOURS, strict=False):
            mine = [p for p in points if p.series == series.name]
            good = [(p.eta, p.variance) for p in mine if p.variance is not None]
            axes.plot(
                *zip(*good, strict=True),
                marker="o",
                markersize=3.5,
                color=colour,
                linewidth=0.9 if not series.scaled else 1.3,
                label=series.label,
            )
            if bad := failures(mine):
                axes.plot(
                    [p.eta for p in bad],
                    [0.0] * len(bad),
                    marker="x",
                    markersize=7,
                    linestyle="none",
                    color=colour,
                    clip_on=False,
                    zorder=5,
                    label=f"{series.label}: run failed, no V",
                )
        axes.axvline(TESTED / WEIGHT, color=FAINT, linewidth=0.9, linestyle=":")
        axes.annotate(
            "N = 112 kN",
            (TESTED / WEIGHT, 0.6),
            xycoords=("data", "axes fraction"),
            xytext=(3, 0),
            textcoords="offset points",
            rotation=90,
            va="center",
            fontsize=8,
            color=INK,
        )
        axes.set(xscale="log", xlabel="axial load over weight η = N / W", ylabel="V(η)")
        axes.set_ylim(bottom=0.0)
        axes.legend(loc="upper left", bbox_to_anchor=(0, 0.93))


if __name__ == "__main__":
    parser(__doc__).parse_args()
    target = docs_folder() / "figures"
    found = study()
    write(found, target)
    for point in failures(found):
        print(f"failed: {point.series} at N = {point.load:.4g} N: {point.status} at t = {point.time:.6g} s")
