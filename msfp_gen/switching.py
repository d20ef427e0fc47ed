"""From a model that left something out to one that has it: which watches stop a run, and what it goes on with."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msfp_gen.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene import Scene
    from msfp_gen.simulation import Segment

# What a watch asks for: the effects that a model must have once it has tripped.
WIDER: dict[str, dict[str, object]] = {
    "rims": {"rims": True},
    "uplift": {"uplift": True, "sliders": "inertial"},
    "inertia": {"sliders": "inertial"},
    "heat": {"friction": "pvt"},
    "plane": {"dimension": "spatial"},
}
JAMMED = ("newton", "step", "irregular")
"""Ends of a run that another model may not have: inertia and compliant seats make equations regular."""
STRICT = ("rims", "uplift", "inertia", "heat")


def stopping(scene: Scene, effects: Effects, strict: bool) -> tuple[str, ...]:
    """The watches at which a run with these effects stops: those that another model would answer; all if strict."""
    if strict:
        return STRICT if isinstance(scene.effects, Auto) else tuple(name for name in STRICT if name != "uplift")
    return tuple(name for name in ("rims", "uplift", "inertia", "heat") if _answer(scene, effects, name) is not None)


def widened(scene: Scene, effects: Effects, segment: Segment) -> Effects | None:
    """The effects that a run goes on with after a segment has ended; None where it has ended for good."""
    run, status = segment.run, segment.status
    if not len(run.rows):
        return None
    if status == "ok" and run.time < scene.end:
        return _answer(scene, effects, "plane")
    if status == "uplift":
        return _answer(scene, effects, "uplift")
    if status in JAMMED:
        return _answer(scene, effects, "inertia") or _answer(scene, effects, "uplift")
    if status != "guard":
        return None
    wider = effects
    for name in stopping(scene, effects, strict=False):  # others that tripped in the same step took notes
        if name in run.trips:
            wider = _answer(scene, wider, name) or wider
    return wider


def _answer(scene: Scene, effects: Effects, name: str) -> Effects | None:
    """Effects with what a watch asks for, where the scene leaves that open and the method can take it."""
    asked = scene.effects
    if not isinstance(asked, Auto) or (name == "uplift" and scene.solver.method == "dopri5"):
        return None
    if name == "heat" and effects.friction != "pv":  # nobody gave the numbers
        return None
    needed = {key: value for key, value in WIDER[name].items() if getattr(effects, key) != value}
    if not needed or any(getattr(asked, key) is not None for key in needed):
        return None
    return replace(effects, **needed)  # type: ignore[arg-type]
