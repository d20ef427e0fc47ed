"""Summary of a run: the numbers that `msfp-gen run --json` prints; their derivatives with respect to parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.analysis.transitions import is_monotonic, transitions
from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.dataset import gradients_of
from msfp_gen.results.extremes import Extremes, by_axis
from msfp_gen.results.gradient import Gradients, gradients_of_extremes
from msfp_gen.results.history import LABELS, Event, History
from msfp_gen.results.sliding import merged, open_times

if TYPE_CHECKING:
    from msfp_gen.results.files import ResultFiles
    from msfp_gen.results.run_data import RunData
    from msfp_gen.scene.parameters import Parameter


def summarise(result: RunData) -> dict[str, Any]:
    """Summary of a run as plain data, ready for JSON; SI units; lists are one value per surface, bottom first.

    Keys:
        name, status, message: of the run.
        notes: messages of monitors, one line each.
        duration: simulated time [s].
        peak_displacement, peak_force: largest magnitude along E1, E2, E3 and in the horizontal plane (`radial`)
            [m], [N]. These and the other extremes are over all accepted steps, whatever the times of the rows.
        axial_load: constant axial load [N]; None without one.
        peak_force_ratio: peak radial force over axial load [-]; None without a constant load.
        peak_sliding, minimum_gap: [m].
        minimum_normal_force, maximum_normal_force: [N].
        friction: coefficients at the surfaces. friction_at_pivot: the same as data sheets give them
            (`Bearing.friction_at_pivot`); None where there are none [-].
        peak_rim_force: [N].
        uplift: of all surfaces together, see `uplift_of`.
        verdict: what the device was asked to bear, against its limits; see `Verdict.as_dict` and docs/limits.md.
        rims_met: surfaces (1..n-1) that reached their rim.
        energy: see `energy_balance`.
        counters: work of the solver.
        wall_time: [s].
        real_time_factor: simulated time over wall time; None if no time was measured.
        least_friction, most_friction: coefficients, of runs with a friction law.
        peak_temperature: [degC], of runs with a friction law that heats.
        transitions: of monotonic runs, see `transitions.transitions`.
    """
    extremes, load, counters = result.extremes, axial_load(result), asdict(result.counters)
    wall_time = counters.pop("wall_time")
    bearing = result.scene.bearing
    sheet = bearing.friction_at_pivot
    summary = {
        **summary_of_run(result, result.history.time, counters, wall_time),
        **peaks_of_bearing(extremes, load),
        "friction": [surface.friction for surface in bearing.surfaces],
        "friction_at_pivot": None if sheet is None else list(sheet),
        "uplift": uplift_of(result.history, extremes, result.events),
        "rims_met": rims_met(result),
        "energy": energy_balance(result.history),
    }
    if extremes.least_friction is not None and extremes.most_friction is not None:
        summary["least_friction"] = extremes.least_friction.tolist()
        summary["most_friction"] = extremes.most_friction.tolist()
    if extremes.temperature is not None:
        summary["peak_temperature"] = extremes.temperature.tolist()
    if is_monotonic(result):
        summary["transitions"] = transitions(result, load)
    return summary


def summary_of_run(result: ResultFiles, time: Array, counters: Mapping[str, int], wall_time: float) -> dict[str, Any]:
    """The part of a summary that bearings and buildings have: name, how the run ended, its duration and its work."""
    duration = float(time[-1] - time[0])
    return {
        "name": result.scene.name,
        "status": result.status,
        "message": result.message,
        "notes": [note.line for note in result.notes],
        "duration": duration,
        "counters": dict(counters),
        "wall_time": wall_time,
        "real_time_factor": duration / wall_time if wall_time > 0 else None,
    }


def peaks_of_bearing(extremes: Extremes, load: float | None) -> dict[str, Any]:
    """The part of a summary that all bearings have, alone or below a building. load: axial [N], where it is known."""
    force = by_axis(extremes.top_force)
    return {
        "peak_displacement": by_axis(extremes.displacement),
        "peak_force": force,
        "axial_load": load,
        "peak_force_ratio": force["radial"] / load if load else None,
        "peak_sliding": extremes.sliding.tolist(),
        "minimum_gap": extremes.gap.tolist(),
        "minimum_normal_force": extremes.least_normal.tolist(),
        "maximum_normal_force": extremes.most_normal.tolist(),
        "peak_rim_force": None if extremes.rim_force is None else extremes.rim_force.tolist(),
    }


def uplift_of(history: Any, extremes: Extremes, events: Sequence[Event] = ()) -> dict[str, Any]:
    """Uplift of a bearing. history: with `time` and `lift`, shape (T, n-1) [m].

    Keys:
        height: largest clearance between the faces of any surface [m].
        duration: longest time for which some surface is open [s], by the events, of buildings by the rows: 0 where it
            is shorter than their distance.
        count: how often the bearing opened, likewise.
    """
    height = 0.0 if extremes.lift is None else float(extremes.lift.max())
    spells = merged(spell for spells in open_times(history, events) for spell in spells) if height else []
    duration = max((length for _, length in spells), default=0.0)
    return {"height": height, "duration": duration, "count": max(len(spells), int(height > 0))}


def rows_of_bearing(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of these peaks."""
    ratio = "" if summary["peak_force_ratio"] is None else f" ({summary['peak_force_ratio']:.3f} of the axial load)"
    least, most = min(summary["minimum_normal_force"]), max(summary["maximum_normal_force"])
    return [
        ("peak displacement", f"{1e3 * summary['peak_displacement']['radial']:.4g} mm"),
        ("peak force", f"{1e-3 * summary['peak_force']['radial']:.4g} kN{ratio}"),
        ("peak sliding", ", ".join(f"{1e3 * s:.4g}" for s in summary["peak_sliding"]) + " mm, bottom first"),
        ("normal force", f"{1e-3 * least:.4g} to {1e-3 * most:.4g} kN"),
    ]


def energy_balance(history: History) -> dict[str, float | None]:
    """Energy balance of a run.

    Keys:
        peak_input: largest magnitude of the input energy [J].
        closure_error: largest magnitude of the numerical term over peak_input [-]; None without input.
        dissipated_share: energy dissipated by friction, rims and dampers of the top over peak_input [-]; None without
            input.
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


def rims_met(result: RunData) -> list[int]:
    """Surfaces (1..n-1) whose slider reached its rim, by an event or by a gap of zero or less in some row."""
    located = {event.surface for event in result.events if event.kind == "rim_contact"}
    closed = np.flatnonzero(result.extremes.gap <= 0) + 1
    return sorted(located | set(closed.tolist()))


def axial_load(result: RunData) -> float | None:
    """The constant axial load on the top plate [N]; None if there is none, or it varies."""
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


WITHOUT = {
    "rims_met": "it is a list of surfaces, which jumps where another rim is met",
    "transitions": "they are read from rows",
    "counters": "they count the work of the solver",
    "error": "errors are measured where a slider meets its rim",
    "energy": "its terms are integrals over the run, which simulate(..., energy_gradients=True) differentiates",
}
"""Keys of the summary that have no derivative, or only where it was asked for, with the reason."""


class SummaryGradient(dict[str, Any]):
    """Derivatives of the summary with respect to one parameter; a key without derivative raises InputError."""

    def __missing__(self, key: str) -> Any:
        reason = WITHOUT.get(key, "it is no number that depends on a parameter")
        raise InputError(f"gradient_summary: {key!r} has no derivative: {reason}; give one of {', '.join(self)}")


def summarise_gradients(result: RunData) -> dict[str, dict[str, Any]]:
    """Derivatives of the scalars of `summarise(result)` in SI units, by the path of the parameter.

    Keys: peak_displacement, peak_force, peak_force_ratio, peak_sliding, minimum_gap, minimum_normal_force,
    maximum_normal_force and, with a friction law, least_friction and most_friction, as in the summary; and of runs with
    `energy_gradients` energy, those of the terms of `History.energy` at the end; where errors were measured, error:
    that of each derivative, with the same keys. Raises InputError where the run computed no derivatives, and for a key
    whose value jumps (`WITHOUT`).
    """
    gradients = gradients_of(result)
    recorded = result.recorded_extremes
    assert recorded is not None  # a run that computed derivatives has recorded its extremes
    slopes = gradients_of_extremes(gradients, result.history, recorded)
    gradients_of_summary = dict[str, dict[str, Any]]()
    for i, parameter in enumerate(gradients.parameters):
        own = {name: values[i] for name, values in slopes.items()}
        gradients_of_summary[parameter.path] = _summary(
            gradients, i, own, _ratio_slope(result, parameter, float(own["top_force"][3]))
        )
        if gradients.error is not None:
            own, load = gradients.error.extremes[i].arrays, axial_load(result)
            ratio = float(own["top_force"][3]) / load if load else None
            gradients_of_summary[parameter.path]["error"] = _summary(gradients.error, i, own, ratio)
    return gradients_of_summary


def _summary(gradients: Gradients, index: int, slopes: dict[str, Array], ratio: float | None) -> SummaryGradient:
    names = (*LABELS["axis"], "radial")
    gradient = SummaryGradient(
        peak_displacement=dict(zip(names, slopes["displacement"].tolist(), strict=True)),
        peak_force=dict(zip(names, slopes["top_force"].tolist(), strict=True)),
        peak_force_ratio=ratio,
        peak_sliding=slopes["sliding"].tolist(),
        minimum_gap=slopes["gap"].tolist(),
        minimum_normal_force=slopes["least_normal"].tolist(),
        maximum_normal_force=slopes["most_normal"].tolist(),
    )
    for name in ("least_friction", "most_friction"):
        if name in slopes:
            gradient[name] = slopes[name].tolist()
    energy = {name.removeprefix("energy_"): v for name, v in gradients.arrays.items() if name.startswith("energy_")}
    if "input" in energy:
        gradient["energy"] = {name: float(values[index, -1]) for name, values in energy.items()}
    return gradient


def _ratio_slope(result: RunData, parameter: Parameter, slope: float) -> float | None:
    """Derivative of peak radial force over axial load; None without a constant load."""
    load = axial_load(result)
    if not load:
        return None
    peak = float(result.extremes.top_force[3])
    return slope / load - peak * _load_slope(result, parameter) / load**2


def _load_slope(result: RunData, parameter: Parameter) -> float:
    """Derivative of `axial_load` with respect to a parameter."""
    scene, name = result.scene, parameter.path
    gravity, mass = scene.bearing.gravity, float(getattr(scene.top, "mass", 0.0)) if scene.top.kind == "mass" else 0.0
    slopes = {"top.axial_load": 1.0, "top.force[2]": -1.0, "top.mass": gravity, "bearing.gravity": mass}
    if name == "load.scale" and scene.load is not None:
        return -float(np.asarray(scene.load.coefficients)[0, 2, 0])
    return slopes.get(name, 0.0)
