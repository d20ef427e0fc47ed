"""Range of the normal force under a supported mass, rigid and on a vertical spring: prints the tables of docs/model.md.

Runs both earthquake scenes on three preset bearings: `python benchmarks/rigid_mass.py`.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from plain import plain_scene
from quick import parser, pick

from msfp_gen import Auto, Bearing, RunError, Scene, presets, simulate
from msfp_gen.scene.top import MassTop

WEIGHT = 112e3
BEARINGS = pick(("prototype-tfp", "becker-tfp", "fenz-tfp"), ("prototype-tfp",))
BEARING_STIFFNESS = 8e9 / 13e6  # vertical stiffness of a bearing per newton of load [1/m]
COLUMNS = 12.0  # vertical frequency of the supported weight on its columns [Hz]
DAMPING = 0.05  # ratio to critical
TOLERANCES = pick((1e-3, 1e-4, 1e-5), (1e-3,))
FINE_TOLERANCES = pick((*TOLERANCES, 1e-6), TOLERANCES)
SLIDER_SHARE = 1e-3  # mass of a slider over the mass that it carries, in bearings as built


@dataclass(frozen=True)
class Support:
    """What is between top plate and mass. stiffness [N/m], None: rigid. ratio: damping over critical damping."""

    name: str
    stiffness: float | None = None
    ratio: float = DAMPING

    def of(self, top: MassTop) -> MassTop:
        """The top with this vertical stiffness and damping."""
        if self.stiffness is None:
            return replace(top, vertical_stiffness=None, vertical_damping=0.0)
        damping = 2 * self.ratio * np.sqrt(self.stiffness * top.mass)
        return replace(top, vertical_stiffness=self.stiffness, vertical_damping=float(damping))


def supports(mass: float) -> list[Support]:
    """Rigid, the stiffness of the bearing, and that of bearing and columns in series."""
    bearing, columns = BEARING_STIFFNESS * WEIGHT, mass * (2 * np.pi * COLUMNS) ** 2
    both = bearing * columns / (bearing + columns)
    return [
        Support("rigid"),
        Support(f"bearing, {_frequency(bearing, mass):.1f} Hz", bearing),
        Support(f"bearing and columns, {_frequency(both, mass):.1f} Hz", both),
    ]


def _frequency(stiffness: float, mass: float) -> float:
    return float(np.sqrt(stiffness / mass) / (2 * np.pi))


def run(scene: Scene, rtol: float) -> str:
    """Least and most N/W of a run, or where it stops."""
    try:
        result, end = simulate(replace(scene, solver=replace(scene.solver, rtol=rtol))), ""
    except RunError as error:
        result, end = error.result, f", `{error.status}` at {error.result.history.time[-1]:.1f} s"
    normal = result.history.normal_force / WEIGHT
    most = f"{normal.max():.2f}" if normal.max() < 100 else "> 100"
    return f"{normal.min():.2f} ... {most}{end}"


def rows(scene_name: str, bearing_names: Iterable[str]) -> None:
    """Lines of the table of one scene."""
    for bearing_name in bearing_names:
        scene = replace(plain_scene(scene_name), bearing=presets.bearing(bearing_name))
        assert isinstance(scene.top, MassTop)
        for support in supports(scene.top.mass):
            carried = replace(scene, top=support.of(scene.top))
            cells = " | ".join(run(carried, rtol) for rtol in TOLERANCES)
            print(f"| {scene_name} | {bearing_name} | {support.name} | {cells} |", flush=True)


def dampings(scene_name: str, bearing_name: str) -> None:
    """The same with other damping, and with uplift in the model: what unloads a bearing is no error of the tolerance."""
    scene = replace(plain_scene(scene_name), bearing=presets.bearing(bearing_name))
    assert isinstance(scene.top, MassTop)
    parting = replace(scene.modelled, uplift=True)
    for ratio, effects in ((0.02, parting), *((ratio, scene.modelled) for ratio in (0.02, 0.03, 0.05, 0.1))):
        top = Support("bearing", BEARING_STIFFNESS * WEIGHT, ratio).of(scene.top)
        cells = " | ".join(run(replace(scene, top=top, effects=effects), rtol) for rtol in TOLERANCES)
        print(f"| {100 * ratio:g} %{', uplift' * effects.uplift} | {cells} |", flush=True)


def with_slider_masses(bearing: Bearing, share: float = SLIDER_SHARE) -> Bearing:
    """The bearing with sliders of this share of the supported mass, in place of model scale; their shapes are kept."""
    sliders = [share * WEIGHT / bearing.gravity / body.mass for body in bearing.bodies[:-1]]
    bodies = [
        replace(body, mass=factor * body.mass, inertia=tuple(factor * value for value in body.inertia))
        for body, factor in zip(bearing.bodies, [*sliders, 1.0], strict=True)
    ]
    return replace(bearing, bodies=bodies)


def full_scale(scene_name: str, bearing_name: str) -> None:
    """Lines of the table of real slider masses, effects chosen by `Auto`: displacement [mm], shear and N over W."""
    scene = plain_scene(scene_name)
    assert isinstance(scene.top, MassTop)
    bearing = with_slider_masses(presets.bearing(bearing_name))
    for support in supports(scene.top.mass)[:2]:
        cells = []
        for rtol in FINE_TOLERANCES:
            solver = replace(scene.solver, rtol=rtol)
            top = support.of(scene.top)
            run_scene = replace(scene, bearing=bearing, top=top, effects=Auto(), solver=solver, output_step=0.01)
            try:
                result, end = simulate(run_scene), ""
            except RunError as error:
                result, end = error.result, f", `{error.status}` at {error.result.history.time[-1]:.1f} s"
            peaks = result.extremes
            displacement, shear = 1e3 * peaks.displacement[3], peaks.top_force[3] / WEIGHT
            normal = result.history.normal_force.max() / WEIGHT
            opened = ", opens" if result.history.lift.max() > 0 else ""
            cells.append(f"{displacement:.1f} / {shear:.3f} / {normal:.2f}{opened}{end}")
        print(f"| {scene_name} | {bearing_name} | {support.name} | " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    tolerances = " | ".join(f"rtol {rtol:g}" for rtol in TOLERANCES)
    print(f"| scene | bearing | support of the mass | {tolerances} |\n|---|---|---|---|---|---|")
    for scene in ("ridgecrest-clc", "ridgecrest-ccc"):
        rows(scene, BEARINGS)
    print(f"\n| damping | {tolerances} |\n|---|---|---|---|")
    dampings("ridgecrest-ccc", "becker-tfp")
    columns = " | ".join(f"rtol {rtol:g}" for rtol in FINE_TOLERANCES)
    print(f"\n| scene | bearing | support of the mass | {columns} |\n|---|---|---|---|---|---|---|")
    for scene in ("ridgecrest-clc", "ridgecrest-ccc"):
        for bearing in BEARINGS:
            full_scale(scene, bearing)


if __name__ == "__main__":
    sys.exit(main())
