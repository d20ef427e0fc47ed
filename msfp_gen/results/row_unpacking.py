"""Rows of compiled runs as a `History` in the frame of the user; joining of the histories of several segments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.model.plane import out_of_plane
from msfp_gen.results.history import Event, History, quantities
from msfp_gen.specification.contract import EVENT_KINDS, WORKS, names

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model

_EVENT_KINDS = names(EVENT_KINDS)


def finite_rows(rows: Array) -> Array:
    """The rows of a segment, shape (T, row size), up to the first that is not finite."""
    finite = np.isfinite(rows).all(axis=1)
    return rows if finite.all() else rows[: int(finite.argmin())]


def history_of(model: Model, rows: Array, azimuth: float, sprung: bool = False) -> History:
    """The rows of a segment in the frame of the user.

    rows: of `finite_rows`, one or more. azimuth: of the frame of the model [rad]. sprung: whether the top has a
    vertical spring.
    """
    f = model.unpack(rows)
    turn = azimuth
    separation = f["q"][..., 3:] if model.effects.uplift else np.zeros_like(f["force"])
    lift = np.maximum(0.0, -f["compression"]) if model.effects.uplift else np.zeros_like(f["normal"])
    base, top = out_of_plane(f["base"], turn, "vector"), out_of_plane(f["top"], turn, "vector")
    across = base - top
    work = dict(zip(names(WORKS), np.moveaxis(f["work"], -1, 0), strict=True))
    energy = {
        "input": work["input"],
        "kinetic": f["kinetic"],
        "potential": f["potential"] - f["potential"][0],
        "restraint": f["restraint"] - f["restraint"][0],
        "friction_stored": work["friction_stored"],
        "friction_dissipated": work["friction_dissipated"],
        "contact_dissipated": work["contact_dissipated"],
        "rim_stored": f["rim_stored"] - f["rim_stored"][0],
        "rim_dissipated": work["rim_dissipated"],
        "top_dissipated": work["top_dissipated"],
        "seat_stored": f["seat_stored"] - f["seat_stored"][0],
        "seat_dissipated": work["seat_dissipated"],
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
        separation=out_of_plane(separation, turn, "vector"),
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
        top_settlement=f["top_settlement"] if sprung else None,
    )


def events_of(model: Model, run: Run, azimuth: float) -> tuple[Event, ...]:
    """The events of a segment in the frame of the user."""
    return tuple(
        Event(
            time=t,
            surface=surface,
            kind=_EVENT_KINDS[kind],  # type: ignore[arg-type]
            displacement=out_of_plane(np.array(u), azimuth, "vector"),
            top_force=out_of_plane(np.array(force), azimuth, "vector"),
        )
        for t, surface, kind, u, force in run.events
    )


def joined(parts: Sequence[History], output_step: float | None = None) -> History:
    """The histories of consecutive segments as one.

    The first row of a later segment repeats the last row of the one before it and is left out. Energies continue from
    their last values. output_step: distance of rows [s]; rows at the end of a segment between them are left out. None:
    rows of every step.
    """
    if len(parts) == 1:
        return parts[0]
    times = np.concatenate([parts[0].time, *(part.time[1:] for part in parts[1:])])
    kept = np.ones(len(times), dtype=bool)
    if output_step is not None:
        ends = np.cumsum([len(part.time) - (index > 0) for index, part in enumerate(parts[:-1])]) - 1
        steps = times[ends] / output_step
        kept[ends[np.abs(steps - np.round(steps)) > 1e-6]] = False
    rows: dict[str, Any] = {}
    for name in quantities():
        columns = [getattr(part, name) for part in parts]
        if columns[-1] is not None:
            columns = [_extended(column, columns[-1], part) for column, part in zip(columns, parts, strict=True)]
            rows[name] = np.concatenate([columns[0], *(column[1:] for column in columns[1:])])[kept]
    across = rows["base_displacement"] - rows["top_displacement"]
    rows["displacement"] = across - across[0]
    return History(**rows, energy={name: _continued(parts, name)[kept] for name in parts[0].energy})


def _extended(column: Array | None, later: Array, part: History) -> Array:
    """A quantity over one segment; where only later models record it (temperature), their first value."""
    return np.tile(later[0], (len(part.time), 1)) if column is None else column


def _continued(parts: Sequence[History], name: str) -> Array:
    """An energy term that continues from its last value in the segment before."""
    terms = [parts[0].energy[name]]
    end = terms[0][-1]  # kept apart: a segment that took no step adds no value
    for part in parts[1:]:
        values = part.energy[name]
        terms.append(end + values[1:] - values[0])
        end = end + values[-1] - values[0]
    return np.concatenate(terms)
