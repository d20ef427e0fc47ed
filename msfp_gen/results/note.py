"""`Note`: the message of a monitor; the notes of a run with one model: time, size and the effects that were added."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from msfp_gen.scene.effect_switching import JAM_STATUSES, REQUIRED_EFFECTS, Ending
from msfp_gen.scene.friction_parameters import RANGES, published_softening
from msfp_gen.specification.layout import Effects


@dataclass(frozen=True)
class Note:
    """Message of a monitor, in one line.

    time [s]: of the first detection. kind: "rims", "uplift", "inertia", "heat", "law_speed", "law_load",
    "law_temperature", "plane", "jammed", "energy", "tolerance", "vibration", "damping", "creep", "peak", "rattle",
    "seats", "rows", "footprint", "ringing", "gradient", "fidelity" or "value". surface: 1..n-1; 0: none. value: what
    the text gives, of a monitor the one furthest beyond its limit: distance beyond the capacity [m], force [N],
    inertial over normal force [-], temperature rise [K], slip velocity [m/s], temperature [degC], share of the energy
    or the force [-], movement [m], distance of the normal force from the axis [m], number of landings, error over the
    derivative [-], value of the scene. action: the effects with which the run continued; "": it continued unchanged, or
    ended. bearing: of a building, from 1; 0: none. value_time: of that value of a monitor [s], else None.
    """

    time: float
    kind: str
    surface: int
    value: float
    text: str
    action: str = ""
    bearing: int = 0
    value_time: float | None = None

    @property
    def line(self) -> str:
        """Time, text and action."""
        return f"t = {self.time:.6g} s: {self.sentence}"

    @property
    def sentence(self) -> str:
        """Text and action."""
        return self.text + (f"; continued with {self.action}" if self.action else "")


_MAX_VELOCITY = RANGES["v"][-1]
TEXTS = {
    "rims": "a slider is {most}{value:.3g} m beyond the capacity of surface {surface}; the model has no rims",
    "uplift": "the normal force of surface {surface} is {value:.4g} N; contacts of the model are rigid and cannot open",
    "footprint": "the normal force of surface {surface} acts {most}{value:.3g} m from the axis of its slider, outside "
    "the face, and the slider of the model cannot tip",
    "inertia": "the inertial force of body {body} is {most}{value:.2g} of N on surface {surface}; the model has none",
    "heat": "friction may heat surface {surface} by {most}{value:.3g} K; its friction law does not depend on "
    "temperature",
    "law_speed": "the slip velocity of surface {surface} is {most}{value:.3g} m/s; its friction law was checked up to "
    f"{_MAX_VELOCITY:g} m/s",
    "law_load": "the normal force of surface {surface} is {value:.4g} N; its friction law was not checked there",
    "law_temperature": "surface {surface} is at {value:.4g} degC; its friction law was not checked there",
    "plane": "motion or loads leave the vertical plane of the model",
    "jammed": "the equations of this model have no solution beyond this time ({status})",
}


CONSEQUENCES = {
    "rims": "a rim would stop it with a force that is missing here: give effects.rims = true",
    "uplift": "the bearing may lift off, and forces are wrong where it does: give effects.uplift = true",
    "footprint": "a real slider would tip: give effects.uplift = true",
    "inertia": "forces are wrong by about that share of N: give effects.sliders = 'inertial'",
    "heat": "friction is then some {softening:.0%} lower than here: give effects.friction = 'pvt'",
    "law_speed": "friction at such velocities is extrapolated",
    "law_load": "friction at such loads is extrapolated",
    "law_temperature": "friction at such temperatures is extrapolated",
}
"""What follows for the results where the run goes on without the effect."""
IMPORTANCE = (
    *("fidelity", "value", "jammed", "energy", "peak", "footprint", "uplift", "rims", "heat", "law_load", "law_speed"),
    *(
        "law_temperature",
        "creep",
        "vibration",
        "tolerance",
        "rattle",
        "seats",
        "rows",
        "damping",
        "inertia",
        "plane",
        "ringing",
        "gradient",
    ),
)
"""Kinds of notes, those first that question most of the results."""
DECISIVE = IMPORTANCE[: IMPORTANCE.index("rims") + 1]
"""Kinds of notes that are always printed: results may not be used before they are read."""
RISING = ("rims", "footprint", "inertia", "heat", "law_speed")
"""Kinds of notes with one limit, from above."""


def monitor_notes(ending: Ending, after: Effects | None) -> list[Note]:
    """The notes of a run with one model, in order of the time at which each monitor tripped first.

    Where the run went on with the same model, the value is the one furthest beyond the limit since then. after: the
    effects with which it continues; None where it does not.
    """
    trips, time, status = dict(ending.trips), ending.time, ending.status
    if after is not None and status == "ok":
        trips["plane"] = (time, 0, 0.0, time)
    if after is not None and status == "uplift":
        trips["uplift"] = (time, ending.surface, ending.value, time)
    if after is not None and status in JAM_STATUSES:
        trips["jammed"] = (time, ending.surface, ending.value, time)
    notes = []
    for kind, (tripped, surface, value, value_time) in sorted(trips.items(), key=lambda item: item[1][0]):
        action = ", ".join(_changes(kind, ending.effects, after))
        text = _text(kind, surface, value, status, went_on=tripped < time, alone=not action)
        notes.append(Note(tripped, kind, surface, value, text, action, value_time=value_time))
    return notes


def by_importance(notes: Iterable[Note]) -> list[Note]:
    """Those first that question most of the results; last those after which the run continued with the effect."""
    return sorted(notes, key=lambda note: (bool(note.action), IMPORTANCE.index(note.kind), note.time))


def _text(kind: str, surface: int, value: float, status: str, went_on: bool, alone: bool) -> str:
    """The text of a monitor. went_on: the run did not end there. alone: and no effect was added."""
    text = TEXTS[kind].format(
        surface=surface, value=value, body=surface + 1, status=status, most="up to " if went_on else ""
    )
    if not went_on or kind not in CONSEQUENCES:
        return text
    consequence = CONSEQUENCES[kind].format(softening=published_softening(value) if kind == "heat" else 0.0)
    return f"from here on, {text}" + (f"; {consequence}" if alone else "")


def joined_notes(earlier: Iterable[Note], later: Iterable[Note]) -> list[Note]:
    """The notes of a run, with the notes of its next model.

    Of two of one kind that changed nothing the first stands for both, with the larger value of those in `RISING`.
    """
    notes = list(earlier)
    for note in later:
        alike = (i for i, other in enumerate(notes) if other.kind == note.kind and not (other.action or note.action))
        index = next(alike, None)
        if index is None:
            notes.append(note)
        elif note.kind in RISING and note.value > notes[index].value:
            notes[index] = replace(note, time=notes[index].time)
    return notes


def _changes(kind: str, before: Effects, after: Effects | None) -> list[str]:
    """The effects that changed after a monitor tripped; after a jam these can be inertia or uplift."""
    # The monitors of a friction law change none, whatever another monitor changes at the same time.
    names = REQUIRED_EFFECTS["uplift"] if kind == "jammed" else REQUIRED_EFFECTS.get(kind, {})
    return [
        f"{name} = {getattr(after, name)}"
        for name in names
        if after is not None and getattr(before, name) != getattr(after, name)
    ]
