"""A scene as the numbers that a page changes and that a run of the WebAssembly module takes."""

from __future__ import annotations

import base64
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.figures.style import COLOURS
from msfp_gen.model.model import Model
from msfp_gen.report.frames import pieces
from msfp_gen.scene.top import RigTop
from msfp_gen.simulation.segment import start_run
from msfp_gen.specification import contract, rows
from msfp_gen.specification.layout import Effects, ModelSpec

if TYPE_CHECKING:
    from types import ModuleType

    from msfp_gen.jit.build import BuildInfo
    from msfp_gen.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Problem:
    """A scene for the page.

    Attributes:
        scene: with fixed effects; `simulate` of it gives the numbers of the page.
        spec: its model.
        data: for the scripts, ready for JSON.
    """

    scene: Scene
    spec: ModelSpec
    data: dict[str, Any]


def problem_of(scene: Scene, title: str) -> Problem:
    """The problem of a scene. Its effects are those at the start, with rims, and do not change during a run.

    Raises InputError for a scene whose top rotates, whose friction heats or whose plates are tilted at the start.
    """
    fixed = fixed_scene(scene)
    effects = cast(Effects, fixed.effects)
    spec = ModelSpec(fixed.bearing.layout, effects)
    arguments, azimuth = run_arguments(fixed, spec)
    run, stack = arguments["run"], arguments["stack"]
    motion, load = (
        {"knots": _packed(knots), "coefficients": _columns(coefficients)}
        for knots, coefficients in ((run[0], run[1]), (run[2], run[3]))
    )
    options = arguments["options"]
    data = {
        "title": title,
        "name": fixed.name,
        "planar": effects.dimension == "planar",
        "azimuth": azimuth,
        "numbers": [
            stack[0],
            contract.names(contract.METHODS).index(options["method"]),
            *(float(options[name]) for name in ("rtol", "atol_angle", "first_step", "max_steps", "duration")),
            *(float(options[name]) for name in ("output_step", "stop_displacement", "stop_all_rims", "sampled")),
            float(options["quasistatic"]),
        ],
        "bodies": np.asarray(stack[1]).tolist(),
        "surfaces": np.asarray(stack[2]).tolist(),
        "top": np.asarray(stack[3]).tolist(),
        "state": [np.asarray(value).ravel().tolist() for value in run[5:8]],
        "motion": motion,
        "load": load,
        "jumps": _packed(run[4]),
        "stops": _packed(options["stops"]),
        "spans": [_packed(options["span_ends"]), _packed(options["span_steps"])],
        "row": _offsets(rows.row(effects), fixed.bearing.layout.surfaces),
        "extremes": _offsets(rows.extremes(effects), fixed.bearing.layout.surfaces),
        "statuses": [status.name for status in contract.STATUSES if status.compiled],
        "values": list(contract.surface_values(effects)),
        "heights": [float(height) for height in fixed.bearing.arrays()["height"]],
        "signs": list(fixed.bearing.layout.signs),
        "outlines": [pieces(fixed.bearing, body) for body in range(fixed.bearing.layout.n)],
        "colours": [COLOURS[index % len(COLOURS)] for index in range(fixed.bearing.layout.surfaces)],
        "axialLoad": fixed.top.axial_load if isinstance(fixed.top, RigTop) and fixed.load is None else None,
        "kind": str(fixed.motion.metadata.get("kind", "")) if hasattr(fixed.motion, "metadata") else "",
        "record": fixed.motion.sampled,
        "amplitude": float(np.abs(fixed.motion.displacement(np.linspace(0.0, fixed.end, 4001))[:, :2]).max()),
        "period": _period(fixed),
    }
    return Problem(fixed, spec, data)


def fixed_scene(scene: Scene) -> Scene:
    """The scene with the effects at its start, and rims. Raises InputError where the page cannot run it."""
    from msfp_gen.simulation.settling import needs_settling

    selection = scene.effect_selection
    refused = {
        "top_rotation": scene.top_rotation is not None,
        "effects.friction": (law := selection.effects.law) is not None and law.depends_on_temperature,
        "motion": needs_settling(scene),
        "effects.uplift": selection.effects.uplift,
    }
    if names := [name for name, true in refused.items() if true]:
        raise InputError(
            f"{names[0]}: the explorer runs scenes without tilted plates, heating and uplift; use `msfp-gen report`"
        )
    effects = replace(selection.effects, rims=True)
    if effects.dimension == "planar" and selection.plane_until < scene.end:
        effects = replace(effects, dimension="spatial")
    return replace(scene, effects=effects)


def run_arguments(scene: Scene, spec: ModelSpec) -> tuple[dict[str, Any], float]:
    """What the compiled run of a scene would be given, and the azimuth of its frame [rad]; nothing is compiled."""
    arguments: dict[str, Any] = {}

    def stack(*values: Any) -> tuple[Any, ...]:
        return values

    def run(values: Any, *positional: Any, **options: Any) -> None:
        arguments.update(stack=values, run=positional, options=options)

    recorder = cast("ModuleType", SimpleNamespace(Stack=stack, Run=run))
    model = Model(spec, recorder, cast("BuildInfo", None))
    _, azimuth = start_run(scene, model, scene.effect_selection, scene.end, None, ())
    return arguments, azimuth


def _period(scene: Scene) -> float | None:
    """Period of the motion [s]; None where it has none."""
    period = scene.motion.metadata.get("period")
    return None if period is None else float(str(period))


def _offsets(quantities: tuple[rows.Quantity, ...], surfaces: int) -> dict[str, list[int]]:
    """Name -> offset and number of values of every field; "" -> the number of all values."""
    lengths = {rows.Extent.SURFACES: surfaces, rows.Extent.COORDINATES: 3, rows.Extent.WORKS: len(contract.WORKS)}
    offsets, offset = {}, 0
    for quantity in quantities:
        size = int(np.prod([lengths[n] if isinstance(n, rows.Extent) else n for n in quantity.shape], dtype=int))
        offsets[quantity.name] = [offset, size]
        offset += size
    return {**offsets, "": [offset, 0]}


def _columns(coefficients: Array) -> dict[str, Any]:
    """Coefficients, shape (k, 6, 6), as their columns that are not zero: indices in a piece, and values."""
    flat = np.asarray(coefficients).reshape(len(coefficients), -1)
    kept = np.flatnonzero(flat.any(axis=0))
    return {"pieces": len(flat), "columns": kept.tolist(), "values": _packed(flat[:, kept])}


def _packed(values: Any) -> str:
    """Numbers as little-endian float64 in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f8").tobytes()).decode("ascii")
