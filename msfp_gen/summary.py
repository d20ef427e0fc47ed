"""A run in a few numbers: what `msfp-gen run --json` prints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.history import LABELS, Array, History
from msfp_gen.transitions import is_monotonic, transitions

if TYPE_CHECKING:
    from msfp_gen.result import Result


def summarise(result: Result) -> dict[str, Any]:
    """Plain dict, JSON-able, SI units, surfaces bottom first.

    name, status, message; notes: what a model left out that began to matter; duration: time simulated [s];
    peak_displacement [m], peak_top_force [N]: largest size along E1, E2, E3 and radial, in the horizontal plane;
    axial_load [N] and peak_force_ratio = radial force over it (None without a constant load); peak_sliding,
    minimum_gap [m], minimum_normal_force, maximum_normal_force [N]: one a surface; rims_met: the surfaces that reached
    their rim; energy: see `energy_balance`; counters; wall_time [s]; with a law of friction least_friction,
    most_friction, and where it heats peak_temperature [degC], one a surface; real_time_factor: seconds simulated a
    second (None if no time was taken); transitions: of a monotonic run only.
    """
    history, counters = result.history, asdict(result.counters)
    duration = float(history.time[-1] - history.time[0])
    wall_time = counters.pop("wall_time")
    load = axial_load(result)
    force = _peaks(history.top_force)
    summary: dict[str, Any] = {
        "name": result.scene.name,
        "status": result.status,
        "message": result.message,
        "notes": [note.line for note in result.notes],
        "duration": duration,
        "peak_displacement": _peaks(history.displacement),
        "peak_top_force": force,
        "axial_load": load,
        "peak_force_ratio": force["radial"] / load if load else None,
        "peak_sliding": history.sliding.max(axis=0).tolist(),
        "minimum_gap": history.gap.min(axis=0).tolist(),
        "rims_met": rims_met(result),
        "minimum_normal_force": history.normal_force.min(axis=0).tolist(),
        "maximum_normal_force": history.normal_force.max(axis=0).tolist(),
        "energy": energy_balance(history),
        "counters": counters,
        "wall_time": wall_time,
        "real_time_factor": duration / wall_time if wall_time > 0 else None,
    }
    if history.friction_coefficient is not None:
        summary["least_friction"] = history.friction_coefficient.min(axis=0).tolist()
        summary["most_friction"] = history.friction_coefficient.max(axis=0).tolist()
    if history.temperature is not None:
        summary["peak_temperature"] = history.temperature.max(axis=0).tolist()
    if is_monotonic(result):
        summary["transitions"] = transitions(result, load)
    return summary


def energy_balance(history: History) -> dict[str, float | None]:
    """peak_input [J]: largest size of the work put in; the rest over it, None where no work was done.

    closure_error: largest size of the numerical term; dissipated_share: what friction, rims and dampers of the top had
    dissipated in the end.
    """
    energy = history.energy
    peak = float(np.abs(energy["input"]).max())
    closure = float(np.abs(energy["numerical"]).max())
    dissipated = float(sum(values[-1] for name, values in energy.items() if name.endswith("_dissipated")))
    return {
        "peak_input": peak,
        "closure_error": closure / peak if peak else None,
        "dissipated_share": dissipated / peak if peak else None,
    }


def rims_met(result: Result) -> list[int]:
    """Surfaces (1..n-1) whose slider reached its rim: by an event, or by a gap that closed in some row."""
    seen = {event.surface for event in result.events if event.kind == "rim_contact"}
    closed = np.flatnonzero((result.history.gap <= 0).any(axis=0)) + 1
    return sorted(seen | set(closed.tolist()))


def axial_load(result: Result) -> float | None:
    """The constant load N that presses on the top plate [N]; None where nothing does, or it changes."""
    scene = result.scene
    loads: dict[str, Callable[[Any], float]] = {
        "rig": lambda top: top.axial_load,
        "prescribed": lambda top: -top.force[2],
        "mass": lambda top: top.mass * scene.bearing.gravity,
    }
    load = loads[scene.top.kind](scene.top)
    if scene.load is not None:
        vertical = scene.load.coefficients[:, 2]
        if np.any(vertical[:, 1:]) or np.any(vertical[:, 0] != vertical[0, 0]):
            return None
        load -= float(vertical[0, 0])
    return load if load > 0 else None


def _peaks(vector: Array) -> dict[str, float]:
    sizes = np.abs(vector).max(axis=0).tolist()
    radial = float(np.hypot(vector[:, 0], vector[:, 1]).max())
    return dict(zip(LABELS["axis"], sizes, strict=True)) | {"radial": radial}
