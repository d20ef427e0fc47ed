"""What a run says about what its model left out: when a watch tripped, by how much, and what followed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.switching import JAMMED, WIDER

if TYPE_CHECKING:
    from msfp_gen.history import History
    from msfp_gen.layout import Effects
    from msfp_gen.scene import Scene
    from msfp_gen.simulation import Segment

CLOSED = 0.02  # of the largest energy: what a balance may miss without a word
TEXTS = {
    "rims": "a slider is {value:.3g} m beyond the capacity of surface {surface}; the model has no rims",
    "uplift": "surface {surface} presses with {value:.4g} N only; the model keeps all surfaces closed",
    "inertia": "inertial forces of body {body} reach {value:.2g} of N on surface {surface}; the model has none",
    "heat": "friction may heat surface {surface} by {value:.3g} K; its coefficient knows no temperature",
    "plane": "motion or loads leave the vertical plane of the model",
    "energy": "{value:.1%} of the energy that came and went is missing: what rings is not resolved; "
    "give a smaller solver.rtol",
    "jammed": "the equations have no way on from here ({status})",
}


@dataclass(frozen=True)
class Note:
    """One line of a run. time [s]; kind: rims, uplift, inertia, heat, plane, jammed or energy; surface 1..n-1, 0: none.

    value: how far [m], N [N], inertial over normal force, bound of the rise [K], share of the energy. action: the model
    that the run went on with, or "" where it went on as it was.
    """

    time: float
    kind: str
    surface: int
    value: float
    text: str
    action: str = ""

    @property
    def line(self) -> str:
        """When, what, and what followed."""
        return f"t = {self.time:.6g} s: {self.text}" + (f"; went on with {self.action}" if self.action else "")


def notes_of(scene: Scene, segment: Segment, after: Effects | None) -> list[Note]:
    """The notes of a segment; `after`: the effects that the run goes on with, None where it does not."""
    run = segment.run
    trips = dict(run.trips)
    if after is not None and segment.status == "ok":
        trips["plane"] = (run.time, 0, 0.0)
    if after is not None and segment.status == "uplift":
        trips["uplift"] = (run.time, *run.status[1:])
    if after is not None and segment.status in JAMMED:
        trips["jammed"] = (run.time, *run.status[1:])
    before = segment.model.effects
    return [
        Note(
            time, kind, surface, value,
            TEXTS[kind].format(surface=surface, value=value, body=surface + 1, status=segment.status),
            ", ".join(_changes(kind, before, after)),
        )
        for kind, (time, surface, value) in sorted(trips.items(), key=lambda item: item[1][0])
    ]  # fmt: skip


def balance_of(scene: Scene, history: History) -> tuple[Note, ...]:
    """A note where the energy of a run does not close to 2 % of the largest of its terms.

    The work of the load up and down its slopes is one of them, though the input holds no more than its difference from
    that of the base. Not counted is what a surface stores or gives over the tolerance of an angle.
    """
    energy, surfaces = history.energy, scene.bearing.surfaces
    terms = [float(np.abs(values).max()) for name, values in energy.items() if name != "numerical"]
    rise = sum(float(s.max()) ** 2 / (2 * x.radius) for s, x in zip(history.sliding.T, surfaces, strict=True))
    pressed = float(history.normal_force.max())
    moves = 3 * scene.solver.angle_tolerance * max(x.friction * x.radius for x in surfaces)
    size = max(*terms, float(np.median(history.normal_force)) * rise) + pressed * moves / CLOSED
    worst = int(np.abs(energy["numerical"]).argmax())
    missing = abs(float(energy["numerical"][worst])) / size if size else 0.0
    if not missing > CLOSED:
        return ()
    return (Note(float(history.time[worst]), "energy", 0, missing, TEXTS["energy"].format(value=missing)),)


def _changes(kind: str, before: Effects, after: Effects | None) -> list[str]:
    """What a watch that tripped has changed; a run without a way on tries whatever is left."""
    names = WIDER.get(kind, {**WIDER["inertia"], **WIDER["uplift"]})
    return [
        f"{name} = {getattr(after, name)}"
        for name in names
        if after is not None and getattr(before, name) != getattr(after, name)
    ]
