"""The page of a building in the HTML report: words, figures, and the data of its view in motion."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np

from msfp_gen.buildings.figures import DEPTH, height_of, level_of, plan_of, size_of
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.arrays import Array
from msfp_gen.report.compared import Comparison
from msfp_gen.report.frames import FEWEST, packed
from msfp_gen.report.page import TERMS as BEARING_TERMS
from msfp_gen.report.page import Page
from msfp_gen.results.sign import shown_sign

SCALES = (1, 2, 5, 10, 20, 50, 100)  # of displacements in the view
SHOWN = 0.12  # displacement in it over the size of the building, about
TERMS = (
    BEARING_TERMS[0],
    ("u", "horizontal displacement across a bearing: {words}, less its value at the start."),
    ("N", "compression between a bearing and the building; at rest its share of the weight. Where it falls to zero, "
     "the bearing would lift off."),
    ("base shear", "horizontal force of the ground on all bearings."),
    ("floor acceleration", "of the centre of mass of a floor; at corners: the largest at the corners of the plan, the "
     "rectangle around the bearings."),
    ("drift", "horizontal displacement of a floor relative to that below, tilt of the floors taken out; at the "
     "stiffness centre of the storey, or at the corners of the plan."),
    ("storey shear", "force that accelerates the floors above."),
    ("floor spectrum", "largest response of oscillators of a period that stand on a floor, at its centre of mass or "
     "the corners of the plan, with 5 % damping."),
    ("left", "capacity of a surface less its sliding: what remains until the slider meets the rim of its dish."),
    ("rim", "the raised edge of a dish. Inner sliders of a triple pendulum meet theirs in strong motion."),
)  # fmt: skip
COMPARISONS = (
    Comparison(
        "superstructure on its bearings",
        "closed forms; an eccentric frame under a record in OpenSees",
        "buildings",
        ("physics/test_buildings.py", "physics/test_building_opensees.py"),
    ),
    Comparison(
        "uplift of bearings below a building",
        "statics, energy, smaller tolerances",
        "uplift",
        ("physics/test_building_uplift.py",),
    ),
)


def magnification(result: BuildingResult) -> int:
    """The magnification with which the view opens: displacements are seen and bearings stay apart."""
    peak = max(bearing.summary["peak_displacement"]["radial"] for bearing in result.bearings)
    wanted = SHOWN * size_of(result.scene) / peak if peak > 0 else 1.0
    return max((scale for scale in SCALES if scale <= wanted), default=1)


def building_view(result: BuildingResult, count: int) -> dict[str, Any]:
    """Data for the scripts, ready for JSON: lengths [m], forces [N], accelerations [m/s^2], axes E1, E2, E3."""
    scene, rows, scale = result.scene, building_rows(result, count), magnification(result)
    nodes = [result.node(node.name)[rows] for node in scene.building.nodes]
    motion = np.stack([node[:, 0] for node in nodes], axis=1)
    motion[..., :3] -= result.ground[rows, None, 0]
    low, high = plan_of(scene)
    size = size_of(scene)
    bearings = [bearing.history.displacement[rows] for bearing in result.bearings]
    mean = np.mean(bearings, axis=0)
    gaps = [bearing.history.gap[rows] for bearing in result.bearings]
    left = np.stack([gap.min(axis=1) for gap in gaps], axis=1)
    heights = np.diff([node.position[2] for node in scene.building.nodes])
    drift = np.hypot(*np.moveaxis(result.drift[rows, :, :2], -1, 0))
    frames = {
        "time": result.time[rows],
        "node": motion,
        "ground": result.ground[rows, 0],
        "top": -np.stack(bearings, axis=1),
        "ratio": result.axial_force[rows] / scene.axial_loads,
        "left": left,
        "left_surface": np.stack([1.0 + gap.argmin(axis=1) for gap in gaps], axis=1),
        "mean": shown_sign().factor * mean,
        "shear": shown_sign().factor * result.base_reaction[rows, :2],
        "acceleration": np.stack([node[:, 2, :3] for node in nodes], axis=1),
        "drift": drift / heights[: drift.shape[1]] if drift.shape[1] else drift,
    }
    return {
        "peak": int(np.hypot(*mean[:, :2].T).argmax()),
        "azimuth": 0.0,
        "sign": shown_sign()._asdict(),
        "surfaces": [],
        "nodes": [{"name": node.name, "position": node.position.tolist()} for node in scene.building.nodes],
        "plates": bool(scene.building.columns),
        "storeys": [column.name for column in scene.building.columns],
        "places": [[*place, level_of(scene, index)] for index, place in enumerate(scene.places.tolist())],
        "labels": [bearing.name or str(index + 1) for index, bearing in enumerate(scene.bearings)],
        "loads": scene.axial_loads.tolist(),
        "plan": [low.tolist(), high.tolist()],
        "size": size,
        "height": height_of(scene),
        "depth": DEPTH * size,
        "radius": 0.022 * size,
        "scale": scale,
        "stage": {"scales": SCALES, "chosen": scale},
        "frames": {name: packed(values) for name, values in frames.items()},
    }


def building_rows(result: BuildingResult, count: int) -> Array:
    """Indices of rows of the view, shape (rows,) [-]: evenly in time, and the peaks of displacement and axial force."""
    time = result.time
    even = np.linspace(0, len(time) - 1, min(len(time), max(count, min(FEWEST, len(time)))))
    peaks = [int(bearing.history.horizontal.argmax()) for bearing in result.bearings]
    least = result.axial_force.argmin(axis=0).tolist()
    return np.unique([*even.round().astype(int), *peaks, *least])


def introduction(result: BuildingResult) -> str:
    """The begin of the first sentence of the page."""
    scene = result.scene
    storeys = f"{len(scene.building.columns)} storeys" if scene.building.columns else "a structure"
    return (
        f"Simulation of {storeys} on {len(scene.bearings)} friction pendulum bearings, weight "
        f"{1e-6 * scene.weight:.4g} MN"
    )


PAGE = Page(
    "building",
    introduction,
    "The frame moves relative to the ground unless the box is cleared; displacements are drawn larger than the frame "
    "by the chosen factor.",
    TERMS,
    {
        "plan": "Plan with the orbits of all bearings",
        "profile": "Peaks over the height",
        "spectra": "Floor spectra",
        "axial": "Axial force of every bearing",
    },
    files(__package__) / "assets",
    "building.html.jinja",
    ("frame.js", "player.js", "building.js"),
    building_view,
)
