"""Rows of compiled runs as named arrays in the user's frame, and those of several runs as one history."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.history import Array, Event, History, quantities
from msfp_gen.plane import out_of_plane

if TYPE_CHECKING:
    from msfp_gen.model import Model

EVENT_KINDS = ("rim_contact", "rim_release", "stop", "lift_off", "landing")


def history_of(model: Model, rows: Array, azimuth: float) -> History:
    """Named arrays in the user's frame."""
    finite = np.isfinite(rows).all(axis=1)
    f = model.unpack(rows if finite.all() else rows[: int(finite.argmin())])
    turn = azimuth
    parted = f["q"][..., 3:] if model.effects.uplift else np.zeros_like(f["force"])
    lift = np.maximum(0.0, -f["compression"]) if model.effects.uplift else np.zeros_like(f["normal"])
    base, top = out_of_plane(f["base"], turn, "vector"), out_of_plane(f["top"], turn, "vector")
    across = base - top
    work = f["work"]
    energy = {
        "input": work[:, 0],
        "kinetic": f["kinetic"],
        "potential": f["potential"] - f["potential"][0],
        "restraint": f["restraint"] - f["restraint"][0],
        "friction_stored": work[:, 1],
        "friction_dissipated": work[:, 2],
        "rim_stored": f["rim_stored"] - f["rim_stored"][0],
        "rim_dissipated": work[:, 3],
        "top_dissipated": work[:, 4],
        "seat_stored": f["seat_stored"] - f["seat_stored"][0],
        "seat_dissipated": work[:, 5],
    }
    energy["kinetic"] = energy["kinetic"] - energy["kinetic"][0]
    energy["numerical"] = energy["input"] - np.sum([v for k, v in energy.items() if k != "input"], axis=0)
    return History(
        time=f["time"],
        tilt_angles=out_of_plane(f["q"][..., :3], turn, "angles"),
        tilt_rates=out_of_plane(f["v"][..., :3], turn, "angles"),
        tilt_accelerations=out_of_plane(f["a"][..., :3], turn, "angles"),
        friction_state=out_of_plane(f["f"], turn, "pair"),
        normal_force=f["normal"],
        contact_angles=out_of_plane(f["angles"], turn, "pair_angles"),
        sliding=f["sliding"],
        gap=f["gap"],
        rim_force=f["rim"],
        separation=out_of_plane(parted, turn, "vector"),
        lift=lift,
        interface_force=out_of_plane(f["force"], turn, "vector"),
        slip_velocity=out_of_plane(f["slip"], turn, "pair"),
        base_displacement=base,
        top_displacement=top,
        displacement=across - across[0],
        top_force=out_of_plane(f["top_force"], turn, "vector"),
        top_moment=out_of_plane(f["top_moment"], turn, "axial"),
        energy=energy,
        friction_coefficient=f.get("mu"),
        temperature=f.get("temperature"),
    )


def events_of(model: Model, run: Any, azimuth: float) -> tuple[Event, ...]:
    """The events of a run."""
    return tuple(
        Event(
            time=t,
            surface=surface,
            kind=EVENT_KINDS[kind],  # type: ignore[arg-type]
            displacement=out_of_plane(np.array(u), azimuth, "vector"),
            top_force=out_of_plane(np.array(force), azimuth, "vector"),
        )
        for t, surface, kind, u, force in run.events
    )


def joined(parts: Sequence[History], output_step: float | None = None) -> History:
    """Histories that follow each other, each starting where the one before ended, as one.

    The first row of a later part repeats the last of the one before, seen by another model: it is left out. Energies go
    on from where they stood. output_step: of even rows [s], between which parts may meet; None: of every step.
    """
    if len(parts) == 1:
        return parts[0]
    times = np.concatenate([parts[0].time, *(part.time[1:] for part in parts[1:])])
    kept = np.ones(len(times), dtype=bool)
    if output_step is not None:
        meetings = np.cumsum([len(part.time) - (index > 0) for index, part in enumerate(parts[:-1])]) - 1
        shares = times[meetings] / output_step
        kept[meetings[np.abs(shares - np.round(shares)) > 1e-6]] = False
    rows: dict[str, Any] = {}
    for name in quantities():
        columns = [getattr(part, name) for part in parts]
        if columns[-1] is not None:
            columns = [_before(column, columns[-1], part) for column, part in zip(columns, parts, strict=True)]
            rows[name] = np.concatenate([columns[0], *(column[1:] for column in columns[1:])])[kept]
    across = rows["base_displacement"] - rows["top_displacement"]
    rows["displacement"] = across - across[0]
    return History(**rows, energy={name: _carried(parts, name)[kept] for name in parts[0].energy})


def _before(column: Array | None, later: Array, part: History) -> Array:
    """What a later model records and this one does not: a temperature, still that of the start."""
    return np.tile(later[0], (len(part.time), 1)) if column is None else column


def _carried(parts: Sequence[History], name: str) -> Array:
    whole = [parts[0].energy[name]]
    for part in parts[1:]:
        values = part.energy[name]
        whole.append(whole[-1][-1] + values[1:] - values[0])
    return np.concatenate(whole)
