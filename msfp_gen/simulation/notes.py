"""The notes of a run: monitors that tripped, with time, size and the effects that were added."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.results.note import Note
from msfp_gen.scene.friction_parameters import RANGES
from msfp_gen.simulation.effect_switching import JAM_STATUSES, REQUIRED_EFFECTS

if TYPE_CHECKING:
    from msfp_gen.results.history import History
    from msfp_gen.scene.scene import Scene
    from msfp_gen.simulation.segment import Segment
    from msfp_gen.specification.layout import Effects

_MAX_VELOCITY = RANGES["v"][-1]
ENERGY_LIMIT = 0.02  # error of the energy closure, over the largest term, above which a note is written
TEXTS = {
    "rims": "a slider is {value:.3g} m beyond the capacity of surface {surface}; the model has no rims",
    "uplift": "the normal force of surface {surface} is only {value:.4g} N; the model has no separation",
    "inertia": "the inertial force of body {body} is {value:.2g} of N on surface {surface}; the model has none",
    "heat": "friction may heat surface {surface} by {value:.3g} K; its friction law does not depend on temperature",
    "law_speed": "the slip velocity of surface {surface} is {value:.3g} m/s; its friction law was checked up to "
    f"{_MAX_VELOCITY:g} m/s",
    "law_load": "the normal force of surface {surface} is {value:.4g} N; its friction law was not checked there",
    "law_temperature": "surface {surface} is at {value:.4g} degC; its friction law was not checked there",
    "plane": "motion or loads leave the vertical plane of the model",
    "energy": "the energy closure has an error of {value:.1%} of the largest energy: vibrations are not resolved; "
    "give a smaller solver.rtol",
    "jammed": "the equations of this model have no solution beyond this time ({status})",
}


def notes_of(segment: Segment, after: Effects | None) -> list[Note]:
    """The notes of a segment, in order of time.

    after: the effects with which the run continues; None where it does not.
    """
    run = segment.run
    trips = dict(run.trips)
    if after is not None and segment.status == "ok":
        trips["plane"] = (run.time, 0, 0.0)
    if after is not None and segment.status == "uplift":
        trips["uplift"] = (run.time, *run.status[1:])
    if after is not None and segment.status in JAM_STATUSES:
        trips["jammed"] = (run.time, *run.status[1:])
    before = segment.model.effects
    return [
        Note(
            time,
            kind,
            surface,
            value,
            TEXTS[kind].format(surface=surface, value=value, body=surface + 1, status=segment.status),
            ", ".join(_changes(kind, before, after)),
        )
        for kind, (time, surface, value) in sorted(trips.items(), key=lambda item: item[1][0])
    ]


def energy_notes(scene: Scene, history: History) -> tuple[Note, ...]:
    """A note where the error of the energy closure exceeds `ENERGY_LIMIT` of the largest term.

    One of the terms is the work of the vertical load along the spherical surfaces, which the input contains only as a
    difference. The limit is raised by the work of friction over the tolerance of angles, which no run can resolve.
    """
    energy, surfaces = history.energy, scene.bearing.surfaces
    terms = [float(np.abs(values).max()) for name, values in energy.items() if name != "numerical"]
    height = sum(float(s.max()) ** 2 / (2 * x.radius) for s, x in zip(history.sliding.T, surfaces, strict=True))
    unresolved_slip = 3 * scene.solver.angle_tolerance * max(x.friction * x.radius for x in surfaces)
    unresolved = float(history.normal_force.max()) * unresolved_slip
    scale = max(*terms, float(np.median(history.normal_force)) * height) + unresolved / ENERGY_LIMIT
    row = int(np.abs(energy["numerical"]).argmax())
    error = abs(float(energy["numerical"][row])) / scale if scale else 0.0
    if not error > ENERGY_LIMIT:
        return ()
    return (Note(float(history.time[row]), "energy", 0, error, TEXTS["energy"].format(value=error)),)


def _changes(kind: str, before: Effects, after: Effects | None) -> list[str]:
    """The effects that changed after a monitor tripped; after a jam these can be those of inertia or of uplift."""
    names = REQUIRED_EFFECTS.get(kind, {**REQUIRED_EFFECTS["inertia"], **REQUIRED_EFFECTS["uplift"]})
    return [
        f"{name} = {getattr(after, name)}"
        for name in names
        if after is not None and getattr(before, name) != getattr(after, name)
    ]
