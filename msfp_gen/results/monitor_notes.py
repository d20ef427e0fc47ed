"""The notes of monitors that tripped in a run with one model, with time, size and the effects that were added."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msfp_gen.results.note import Note
from msfp_gen.scene.effect_switching import JAM_STATUSES, REQUIRED_EFFECTS
from msfp_gen.scene.friction_parameters import RANGES

if TYPE_CHECKING:
    from msfp_gen.scene.effect_switching import Ending
    from msfp_gen.specification.layout import Effects

_MAX_VELOCITY = RANGES["v"][-1]
TEXTS = {
    "rims": "a slider is {value:.3g} m beyond the capacity of surface {surface}; the model has no rims",
    "uplift": "the normal force of surface {surface} is {value:.4g} N; contacts of the model are rigid and cannot open",
    "inertia": "the inertial force of body {body} is {value:.2g} of N on surface {surface}; the model has none",
    "heat": "friction may heat surface {surface} by {value:.3g} K; its friction law does not depend on temperature",
    "law_speed": "the slip velocity of surface {surface} is {value:.3g} m/s; its friction law was checked up to "
    f"{_MAX_VELOCITY:g} m/s",
    "law_load": "the normal force of surface {surface} is {value:.4g} N; its friction law was not checked there",
    "law_temperature": "surface {surface} is at {value:.4g} degC; its friction law was not checked there",
    "plane": "motion or loads leave the vertical plane of the model",
    "jammed": "the equations of this model have no solution beyond this time ({status})",
}


def monitor_notes(ending: Ending, after: Effects | None) -> list[Note]:
    """The notes of a run with one model, in order of time.

    after: the effects with which it continues; None where it does not.
    """
    trips, time, status = dict(ending.trips), ending.time, ending.status
    if after is not None and status == "ok":
        trips["plane"] = (time, 0, 0.0)
    if after is not None and status == "uplift":
        trips["uplift"] = (time, ending.surface, ending.value)
    if after is not None and status in JAM_STATUSES:
        trips["jammed"] = (time, ending.surface, ending.value)
    return [
        Note(
            time,
            kind,
            surface,
            value,
            TEXTS[kind].format(surface=surface, value=value, body=surface + 1, status=status),
            ", ".join(_changes(kind, ending.effects, after)),
        )
        for kind, (time, surface, value) in sorted(trips.items(), key=lambda item: item[1][0])
    ]


def _changes(kind: str, before: Effects, after: Effects | None) -> list[str]:
    """The effects that changed after a monitor tripped; after a jam these can be those of inertia or of uplift.

    The monitors of a friction law change none, whatever another monitor changes at the same time.
    """
    names = REQUIRED_EFFECTS["uplift"] if kind == "jammed" else REQUIRED_EFFECTS.get(kind, {})
    return [
        f"{name} = {getattr(after, name)}"
        for name in names
        if after is not None and getattr(before, name) != getattr(after, name)
    ]
