"""The rows and events of segments in the frame of the user."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.model.compiled import CompiledBearingRun
from msfp_gen.model.model import Model
from msfp_gen.model.plane import out_of_plane
from msfp_gen.results.history import Event, History
from msfp_gen.scene.effect_switching import Ending
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.scene import Scene
from msfp_gen.specification.contract import EVENT_KINDS, WORKS, names
from msfp_gen.specification.friction_laws import Law

_EVENT_KINDS = names(EVENT_KINDS)


def finite_rows(rows: Array) -> Array:
    """The rows of a segment, shape (T, row size) [SI], up to the first that is not finite."""
    finite = np.isfinite(rows).all(axis=1)
    return rows if finite.all() else rows[: int(finite.argmin())]


def history_of(model: Model, rows: Array, azimuth: float, sprung: bool) -> History:
    """Rows of a segment in the frame of the user.

    rows: all of `finite_rows`, one or more. azimuth: of the frame of the model [rad]. sprung: whether the top has a
    vertical spring.
    """
    return History(**unpacked(model, rows, azimuth, sprung))


def unpacked(model: Model, rows: Array, azimuth: float, sprung: bool) -> dict[str, Any]:
    """The fields of `History` from rows of a segment, or from derivatives of rows: they are linear in the rows."""
    f, start, turn = model.unpack(rows), model.unpack(rows[0]), azimuth
    separation = f["q"][..., 3:] if model.effects.uplift else np.zeros_like(f["force"])
    lift = np.maximum(0.0, -f["compression"]) if model.effects.uplift else np.zeros_like(f["normal"])
    base, top = out_of_plane(f["base"], turn, "vector"), out_of_plane(f["top"], turn, "vector")
    across = base - top
    across_start = out_of_plane(start["base"], turn, "vector") - out_of_plane(start["top"], turn, "vector")
    work = dict(zip(names(WORKS), np.moveaxis(f["work"], -1, 0), strict=True))
    energy = {
        "input": work["input"],
        "kinetic": f["kinetic"] - start["kinetic"],
        "potential": f["potential"] - start["potential"],
        "restraint": f["restraint"] - start["restraint"],
        "friction_stored": work["friction_stored"],
        "friction_dissipated": work["friction_dissipated"],
        "contact_dissipated": work["contact_dissipated"],
        "rim_stored": f["rim_stored"] - start["rim_stored"],
        "rim_dissipated": work["rim_dissipated"],
        "top_dissipated": work["top_dissipated"],
        "seat_stored": f["seat_stored"] - start["seat_stored"],
        "seat_dissipated": work["seat_dissipated"],
    }
    # One term after the other: the digits of a sum by NumPy depend on the number of rows.
    energy["numerical"] = energy["input"] - reduce(np.add, [v for k, v in energy.items() if k != "input"])
    return {
        "time": f["time"],
        "tilt_angles": out_of_plane(f["q"][..., :3], turn, "angles"),
        "tilt_rates": out_of_plane(f["v"][..., :3], turn, "angles"),
        "tilt_accelerations": out_of_plane(f["a"][..., :3], turn, "angles"),
        "friction_state": out_of_plane(f["f"], turn, "pair"),
        "normal_force": f["normal"],
        "contact_angles": out_of_plane(f["angles"], turn, "pair_angles"),
        "sliding": f["sliding"],
        "gap": f["gap"],
        "rim_force": f["rim"],
        "separation": out_of_plane(separation, turn, "vector"),
        "lift": lift,
        "interface_force": out_of_plane(f["force"], turn, "vector"),
        "slip_velocity": out_of_plane(f["slip"], turn, "pair"),
        "base_displacement": base,
        "top_displacement": top,
        "displacement": across - across_start,
        "top_force": out_of_plane(f["top_force"], turn, "vector"),
        "top_moment": out_of_plane(f["top_moment"], turn, "axial"),
        "energy": energy,
        "friction_coefficient": f.get("mu"),
        "temperature": f.get("temperature"),
        "memory": f.get("memory"),
        "top_settlement": f["top_settlement"] if sprung else None,
    }


def events_of(run: CompiledBearingRun, azimuth: float) -> tuple[Event, ...]:
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


@dataclass(frozen=True, eq=False)
class Segment:
    """A compiled run that has ended, with its model.

    azimuth: of the frame of the model [rad]. status: how the run ended. wall, setup: wall time of the integration, and
    of build and preparation before it [s].
    """

    model: Model
    run: CompiledBearingRun
    azimuth: float
    status: str
    wall: float
    setup: float

    @property
    def ending(self) -> Ending:
        """How it ended."""
        _, surface, value = self.run.status
        return Ending(self.model.effects, self.status, self.run.time, surface, value, self.run.trips)


def temperature_row(law: Law | None, scene: Scene) -> dict[str, Array]:
    """The temperature of every surface at the start as "temperature", shape (n-1,) [degC]; nothing without one.

    Rows of earlier models without heat have it, and the friction law in them. law: of the last model.
    """
    if law is None or not law.depends_on_temperature:
        return {}
    parameters = [law_parameters(law, scene.bearing, index) for index in range(scene.bearing.layout.surfaces)]
    return {"temperature": np.array([of_surface["start_temperature"] for of_surface in parameters])}
