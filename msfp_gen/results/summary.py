"""Summary of a run, the numbers that `msfp-gen run --json` prints, and its tables; derivatives by parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.tables import Table, yes
from msfp_gen.results.dataset import gradients_of
from msfp_gen.results.gradients import Gradients, gradients_of_extremes
from msfp_gen.results.history import BearingRows, History, by_axis
from msfp_gen.results.sliding import SHARE, merged, open_times, slip_shares
from msfp_gen.scene.bearing import Surface
from msfp_gen.scene.parameters import Parameter
from msfp_gen.scene.top import MassTop

if TYPE_CHECKING:
    from msfp_gen.results.result import AnyResult, Result

WINDOW = 2e-4  # displacement over which shares of sliding are taken [m]
MONOTONIC = 1e-3  # largest reverse or transverse motion of a monotonic run, over the largest displacement
STOPS = {"u_star": 2, "u_star_star": 3}  # surfaces of a four-surface stack that stop sliding (Table 4.2)
RIMS = (1, 4)  # surfaces of a four-surface stack whose rims are met (Table 4.2)
SYMBOLS = {"u_star": "u*", "u_star_star": "u**"}  # keys that PEER 2017/07 writes differently


def is_monotonic(result: Result) -> bool:
    """Whether the run is a monotonic push: its motion is a ramp, or the displacement has no reversal.

    Never for a bearing below a building, whose first contacts of rims are not located.
    """
    if not result.is_alone:
        return False
    if result.scene.motion.metadata.get("source") == "ramp":
        return True
    along, transverse = result.history.path
    peak = along.max(initial=0.0)
    reverse = (np.maximum.accumulate(along) - along).max(initial=0.0)
    return bool(peak > WINDOW and max(reverse, np.abs(transverse).max()) <= MONOTONIC * peak)


def transitions(result: Result) -> dict[str, float | None]:
    """Displacements [m], and forces over the axial load [-], at which the sliding regimes of a monotonic run change.

    Stacks of four surfaces have u_star, u_star_star (surfaces 2, 3 stop sliding) and u_dr1, u_dr4, F_dr1, F_dr4 (first
    contact of rims 1, 4), Table 4.2; other stacks have u_dr and F_dr of every surface. A value is None if the
    transition does not occur. `resolution` [m] is the largest spacing of rows at u_star and u_star_star, which limits
    their accuracy; rim contacts are located by the runtime.
    """
    history, axial_load = result.history, result.axial_load
    four = history.surfaces == 4
    values: dict[str, float | None] = {}
    if four:
        values |= {name: stopping_displacement(history, surface) for name, surface in STOPS.items()}
    for surface in RIMS if four else range(1, history.surfaces + 1):
        displacement, force = _first_contact(result, surface)
        values[f"u_dr{surface}"] = displacement
        values[f"F_dr{surface}"] = None if force is None or not axial_load else force / axial_load
    if four:
        values["resolution"] = max(
            (_spacing(history, u) for u in map(values.get, STOPS) if u is not None), default=None
        )
    return values


def stopping_displacement(history: BearingRows, surface: int) -> float | None:
    """Displacement [m] at which `surface` (1..n-1) stops sliding; None if it never slides or never stops.

    It stops where its share of all sliding, taken over a centred `WINDOW` of displacement, falls below `SHARE` and
    stays below over one more window, so that a short vibration does not count.
    """
    along, _ = history.path
    rows = np.flatnonzero(np.diff(np.maximum.accumulate(along), prepend=-1.0) > 0)  # new maxima: strictly increasing
    u, sliding = along[rows], history.sliding[rows]
    if len(u) < 2 or u[-1] - u[0] <= WINDOW:
        return None
    per_window = 20
    centres = np.arange(u[0] + WINDOW / 2, u[-1] - WINDOW / 2, WINDOW / per_window)
    ends = (np.column_stack([np.interp(centres + half, u, s) for s in sliding.T]) for half in (-WINDOW / 2, WINDOW / 2))
    below = slip_shares(np.abs(np.subtract(*ends)))[:, surface - 1] - SHARE
    slides = np.cumsum(below >= 0) > 0
    stays = np.array([(below[i : i + per_window] < 0).all() for i in range(len(below))])
    stopped = np.flatnonzero(slides & stays)
    if not stopped.size:
        return None
    i = int(stopped[0])  # below[i - 1] >= 0 > below[i]
    return float(np.interp(0.0, below[[i, i - 1]], centres[[i, i - 1]]))


def _spacing(history: BearingRows, displacement: float) -> float:
    """Difference of displacement [m] between the rows on either side of `displacement` [m]."""
    maxima = np.maximum.accumulate(history.path[0])
    row = int(np.searchsorted(maxima, displacement))
    return float(maxima[row] - maxima[row - 1])


def _first_contact(result: Result, surface: int) -> tuple[float, float] | tuple[None, None]:
    """Displacement [m] and force [N] along the direction of the run at the first contact with the rim of `surface`."""
    direction = result.history.direction
    for event in result.events:
        if event.kind == "rim_contact" and event.surface == surface:
            return float(event.displacement[:2] @ direction), float(event.top_force[:2] @ direction)
    return None, None


def summarise(result: Result) -> dict[str, Any]:
    """Summary of a `Result` as plain data, ready for JSON; SI units; lists are one value per surface, bottom first.

    Keys:
        name, status, message: of the run.
        notes: messages of monitors, one line each.
        duration: simulated time [s].
        peak_displacement, peak_force: largest magnitude along E1, E2, E3 and in the horizontal plane (`radial`)
            [m], [N]. These and the other extremes are over all accepted steps, whatever the times of the rows.
        axial_load: constant axial load [N]; None without one.
        peak_force_ratio: peak radial force over axial load [-]; None without a constant load.
        peak_sliding, minimum_gap: [m]. capacity_used: sliding over capacity, 1 where a slider meets its rim [-].
        minimum_normal_force, maximum_normal_force: [N].
        minimum_load_ratio: least normal force of any surface over the load at rest, 0 where one opens [-]; None without
            a load at rest.
        friction: coefficients at the surfaces. Of a run of one pendulum in place of the stack no key of surfaces is
            given. friction_at_pivot: the same as data sheets give them
            (`Bearing.friction_at_pivot`); None where there are none [-].
        peak_rim_force: [N].
        uplift: of all surfaces together, see `uplift_of`.
        verdict: what the device was asked to bear, against its limits; see `Verdict.as_dict` and docs/results.md.
        rims_met: surfaces (1..n-1) that reached their rim.
        times: when each peak was reached first [s]: peak_displacement, peak_force and the keys of extremes of surfaces,
            each in the shape of its values.
        energy: see `energy_balance`.
        counters: work of the solver.
        wall_time: [s].
        real_time_factor: simulated time over wall time; None if no time was measured.
        least_friction, most_friction: coefficients, of runs with a friction law.
        peak_temperature: [degC], of runs with a friction law that heats.
        transitions: of monotonic runs, see `transitions`.

    A bearing below a building has no name of a run, duration, counters and energy balance of its own; its axial_load is
    at rest. Instead it has number (from 1), name, layout and position in plan [m]; minimum_load_ratio and
    maximum_load_ratio: axial force over the load at rest, 0 where the bearing lifts [-]; displacement_used: peak
    displacement over that at which all rims are met [-]; dissipated, and by its interface interface_dissipated: at the
    end [J].
    """
    if result.mounting is not None:
        return {**result.mounting.summary, **result.of_bearing}
    _, history, work = result.alone
    counters = asdict(work)
    wall_time = counters.pop("wall_time")
    return {
        **summary_of_run(result, history.time, counters, wall_time),
        **result.of_bearing,
        "energy": energy_balance(history),
    }


def summary_of_run(result: AnyResult, time: Array, counters: Mapping[str, int], wall_time: float) -> dict[str, Any]:
    """The part of a summary that bearings and buildings have: name, how the run ended, its duration and its work."""
    duration = float(result.scene.end if result.status == "ok" else time[-1])  # rows may end before a complete run
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


# Extremes of surfaces -> keys of the summary; those that not every run has are left out of it.
OF_SURFACES = {
    "sliding": "peak_sliding",
    "gap": "minimum_gap",
    "least_normal": "minimum_normal_force",
    "most_normal": "maximum_normal_force",
    "least_friction": "least_friction",
    "most_friction": "most_friction",
    "temperature": "peak_temperature",
    "rim_force": "peak_rim_force",
}


def summary_of_bearing(one: Result) -> dict[str, Any]:
    """The part of a summary that all bearings have, alone or below a building."""
    extremes, load, sheet = one.extremes, one.axial_load, one.bearing.friction_at_pivot
    force = by_axis(extremes.top_force)
    recorded = {key: getattr(extremes, name) for name, key in OF_SURFACES.items()}
    summary: dict[str, Any] = {
        "peak_displacement": by_axis(extremes.displacement),
        "peak_force": force,
        "axial_load": load,
        "peak_force_ratio": force["radial"] / load if load else None,
        "times": {
            "peak_displacement": by_axis(extremes.times["displacement"]),
            "peak_force": by_axis(extremes.times["top_force"]),
        },
    }
    if one.one_pendulum:
        return summary
    if one.mounting is None:  # otherwise the axial force of the bearing counts
        summary["minimum_load_ratio"] = _least_ratio(one)
    times = {key: extremes.times[name].tolist() for name, key in OF_SURFACES.items() if recorded[key] is not None}
    summary |= {
        "times": summary["times"] | times,
        **{key: values.tolist() for key, values in recorded.items() if values is not None},
        "capacity_used": (1.0 - extremes.gap / one.bearing.arrays()["capacity"]).tolist(),
        "friction": [surface.friction for surface in one.bearing.surfaces],
        "friction_at_pivot": None if sheet is None else list(sheet),
        "uplift": uplift_of(one),
        "rims_met": rims_met(one),
    }
    return summary | ({"transitions": transitions(one)} if is_monotonic(one) else {})


def _least_ratio(one: Result) -> float | None:
    """Least normal force of any surface of a bearing alone over the load at rest; None without one."""
    (load,), lift = one.scene.loads_at_rest, one.extremes.lift
    opened = lift is not None and lift.max() > 0
    least = 0.0 if opened else float(one.extremes.least_normal.min())
    return max(least, 0.0) / load if load > 0 else None


def uplift_of(one: Result) -> dict[str, Any]:
    """Uplift of a bearing.

    Keys:
        height: largest clearance between the faces of any surface [m].
        duration: longest time for which some surface is open [s], by the events, of buildings by the rows: 0 where it
            is shorter than their distance.
        count: how often the bearing opened, likewise.
    """
    height = 0.0 if one.extremes.lift is None else float(one.extremes.lift.max())
    spells = merged(spell for spells in open_times(one.history, one.events) for spell in spells) if height else []
    duration = max((length for _, length in spells), default=0.0)
    return {"height": height, "duration": duration, "count": max(len(spells), int(height > 0))}


def rows_of_bearing(
    summary: Mapping[str, Any], about: tuple[str, str], loads: Sequence[tuple[str, str]] = ()
) -> list[tuple[str, str]]:
    """Label and value of the main results in the summary of a bearing.

    about: the first row, of the run or of the place of the bearing. loads: rows after the forces.
    """
    ratio = "" if summary["peak_force_ratio"] is None else f" ({summary['peak_force_ratio']:.3f} of the axial load)"
    at = {key: f" at {times['radial']:.4g} s" for key, times in summary["times"].items() if isinstance(times, Mapping)}
    whole = [
        about,
        ("peak displacement", _along(summary["peak_displacement"], 1e3, "mm", at["peak_displacement"])),
        ("peak force", _along(summary["peak_force"], 1e-3, "kN", at["peak_force"]) + ratio),
    ]
    if "peak_sliding" not in summary:  # of one pendulum in place of the stack
        return [*whole, *loads]
    least, most = min(summary["minimum_normal_force"]), max(summary["maximum_normal_force"])
    return [
        *whole,
        ("peak sliding", ", ".join(f"{1e3 * s:.4g}" for s in summary["peak_sliding"]) + " mm, bottom first"),
        ("normal force", f"{1e-3 * least:.4g} to {1e-3 * most:.4g} kN"),
        *loads,
    ]


def ratios_text(summary: Mapping[str, Any], to: str = " to ") -> str:
    """Least and largest axial force over the load at rest; 0 where the bearing lifts."""
    least, most = summary["minimum_load_ratio"], summary["maximum_load_ratio"]
    return f"{least:.2f}{' (lifts)' if least == 0 else ''}{to}{most:.2f}"


def _along(peaks: Mapping[str, float], scale: float, unit: str, at: str) -> str:
    """The peak in the horizontal plane and its time, and the peaks along its axes."""
    radial, *axes = (f"{peaks[key] * scale:.4g}" for key in ("radial", "E1", "E2"))
    return f"{radial} {unit}{at}, along E1 {axes[0]}, E2 {axes[1]}"


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


def rims_met(result: Result) -> list[int]:
    """Surfaces (1..n-1) whose slider reached its rim, by an event or by a gap of zero or less in some row."""
    located = {event.surface for event in result.events if event.kind == "rim_contact"}
    closed = np.flatnonzero(result.extremes.gap <= 0) + 1
    return sorted(located | set(closed.tolist()))


WITHOUT = {
    "rims_met": "it is a list of surfaces, which jumps where another rim is met",
    "transitions": "they are read from rows",
    "counters": "they count the work of the solver",
    "times": "they jump where another peak is the largest",
    "error": "errors are measured where a slider meets its rim",
    "energy": "its terms are integrals over the run, which simulate(..., energy_gradients=True) differentiates",
}
"""Keys of the summary that have no derivative, or only where it was asked for, with the reason."""


class SummaryGradient(dict[str, Any]):
    """Derivatives of the summary with respect to one parameter; a key without derivative raises InputError."""

    def __missing__(self, key: str) -> Any:
        reason = WITHOUT.get(key, "it is no number that depends on a parameter")
        raise InputError(f"gradient_summary: {key!r} has no derivative: {reason}; give one of {', '.join(self)}")


def summarise_gradients(result: Result) -> dict[str, dict[str, Any]]:
    """Derivatives of the scalars of `summarise(result)` in SI units, by the path of the parameter.

    Keys: peak_displacement, peak_force, peak_force_ratio, peak_sliding, minimum_gap, minimum_normal_force,
    maximum_normal_force, peak_rim_force and, with a friction law, least_friction, most_friction and peak_temperature,
    as in the summary; and of runs with `energy_gradients` energy, the derivatives of the terms of `History.energy` at
    the end; where errors were measured, error: of each derivative, with the same keys. Raises InputError where the run
    computed no derivatives, and for a key whose value jumps (`WITHOUT`).
    """
    gradients = gradients_of(result)
    recorded = result.recorded_extremes
    assert recorded is not None  # a run that computed derivatives has recorded its extremes
    slopes = gradients_of_extremes(gradients, result.alone.history, recorded)
    gradients_of_summary = dict[str, dict[str, Any]]()
    for i, parameter in enumerate(gradients.parameters):
        own = {name: values[i] for name, values in slopes.items()}
        gradients_of_summary[parameter.path] = _summary(
            gradients, i, own, _ratio_slope(result, parameter, float(own["top_force"][3]))
        )
        if gradients.error is not None:
            own, load = gradients.error.extremes[i].arrays, result.axial_load
            ratio = float(own["top_force"][3]) / load if load else None
            gradients_of_summary[parameter.path]["error"] = _summary(gradients.error, i, own, ratio)
    return gradients_of_summary


def _summary(gradients: Gradients, index: int, slopes: dict[str, Array], ratio: float | None) -> SummaryGradient:
    gradient = SummaryGradient(
        peak_displacement=by_axis(slopes["displacement"]),
        peak_force=by_axis(slopes["top_force"]),
        peak_force_ratio=ratio,
        **{key: slopes[name].tolist() for name, key in OF_SURFACES.items() if name in slopes},
    )
    energy = {name.removeprefix("energy_"): v for name, v in gradients.arrays.items() if name.startswith("energy_")}
    if "input" in energy:
        gradient["energy"] = {name: float(values[index, -1]) for name, values in energy.items()}
    return gradient


def _ratio_slope(result: Result, parameter: Parameter, slope: float) -> float | None:
    """Derivative of peak radial force over axial load; None without a constant load."""
    load = result.axial_load
    if not load:
        return None
    peak = float(result.extremes.top_force[3])
    return slope / load - peak * _load_slope(result, parameter) / load**2


def _load_slope(result: Result, parameter: Parameter) -> float:
    """Derivative of `axial_load` with respect to a parameter."""
    scene, name = result.alone.scene, parameter.path
    gravity, mass = scene.bearing.gravity, scene.top.mass if isinstance(scene.top, MassTop) else 0.0
    slopes = {"top.axial_load": 1.0, "top.force[2]": -1.0, "top.mass": gravity, "bearing.gravity": mass}
    if name == "load.scale" and scene.load is not None:
        return -float(np.asarray(scene.load.coefficients)[0, 2, 0])
    return slopes.get(name, 0.0)


MEANINGS = {
    "u_star": "surface 2 stops sliding",
    "u_star_star": "surface 3 stops sliding",
    "u_dr": "first contact with rim {}",
    "F_dr": "force over axial load at first contact with rim {}",
    "resolution": "largest spacing of rows at u* and u**",
}


def time_row(summary: Mapping[str, Any]) -> tuple[str, str]:
    """Label and value of the time that was simulated, and of the wall time."""
    factor = summary["real_time_factor"]
    text = f"{summary['duration']:.6g} s in {summary['counters']['steps']} steps, {summary['wall_time']:.3g} s"
    return "time", text + ("" if factor is None else f", {factor:.4g} times real time")


def work_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of the energy of a run of one bearing, and of the work of the solver."""
    counters = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in summary["counters"].items() if count)
    return [("energy", _energy(summary["energy"])), ("solver", counters)]


# Column -> (key of the values, scale, format). Columns whose key a run does not have are left out.
SURFACE_COLUMNS: dict[str, tuple[str, float, str]] = {
    "peak sliding [mm]": ("peak_sliding", 1e3, ".2f"),
    "capacity [mm]": ("capacity", 1e3, ".2f"),
    "least gap [mm]": ("minimum_gap", 1e3, ".2f"),
    "rim met": ("rim_met", 1, ""),
    "rim [kN]": ("peak_rim_force", 1e-3, ".2f"),
    "least N [kN]": ("minimum_normal_force", 1e-3, ".3f"),
    "peak N [kN]": ("maximum_normal_force", 1e-3, ".3f"),
    "least mu": ("least_friction", 1.0, ".4f"),
    "peak mu": ("most_friction", 1.0, ".4f"),
    "peak T [degC]": ("peak_temperature", 1.0, ".1f"),
}


def surface_peaks_table(summary: Mapping[str, Any], surfaces: Sequence[Surface]) -> Table:
    """Peaks of the surfaces of a bearing."""
    values: dict[str, Any] = {
        **summary,
        "capacity": [surface.capacity for surface in surfaces],
        "rim_met": [yes(index + 1 in summary["rims_met"]) for index in range(len(surfaces))],
    }
    if not any(summary["peak_rim_force"]):
        del values["peak_rim_force"]
    columns = {name: column for name, column in SURFACE_COLUMNS.items() if column[0] in values}
    rows = [
        (str(index + 1), *(format(values[key][index] * scale, style) for key, scale, style in columns.values()))
        for index in range(len(surfaces))
    ]
    return Table("surfaces, bottom first", ("surface", *columns), rows)


def transition_table(transitions: Mapping[str, float | None]) -> Table:
    """Transitions between the sliding regimes of a monotonic run; keys as in `transitions`."""
    rows = []
    for key, value in transitions.items():
        kind = key.rstrip("0123456789")
        shown = "none" if value is None else f"{value:.4f}" if kind == "F_dr" else f"{value * 1e3:.2f} mm"
        rows.append((SYMBOLS.get(key, key), shown, MEANINGS[kind].format(key.removeprefix(kind))))
    return Table("transitions between sliding regimes (PEER 2017/07, Table 4.2)", (), rows)


def _energy(energy: Mapping[str, float | None]) -> str:
    if energy["closure_error"] is None:
        return "no energy input"
    return (
        f"balance closes to {energy['closure_error']:.2g} of the peak input {energy['peak_input']:.4g} J, "
        f"{energy['dissipated_share']:.1%} dissipated"
    )
