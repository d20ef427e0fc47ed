"""Effects of a run: those that a method supports; the monitors of what a model leaves out, with the limits beyond which
that matters (docs/effects.md); those that end a segment, and the effects of the next one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.scene.effect_selection import (
    UPLIFT_MONITOR_SHARE,
    EffectSelection,
    inertia_limit,
    load_at_rest,
    rigid_mass_limit,
    slider_period,
)
from msfp_gen.scene.friction_parameters import checked_range, heated_contacts, thermal_softening
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene.scene_fields import SceneFields
    from msfp_gen.scene.solver import Solver

# The effects that a model needs after a monitor has tripped.
REQUIRED_EFFECTS: dict[str, dict[str, object]] = {
    "rims": {"rims": True},
    "uplift": {"uplift": True, "sliders": "inertial"},
    "footprint": {"uplift": True, "sliders": "inertial"},
    "inertia": {"sliders": "inertial"},
    "heat": {"friction": "pvt"},
    "plane": {"dimension": "spatial"},
}
JAM_STATUSES = ("newton", "step", "irregular")
"""Failures that another model may avoid: inertia and compliant contacts make the equations regular."""
MONITORS = ("rims", "uplift", "footprint", "inertia", "heat")


class Requested(Protocol):
    """The input that decides the effects of a run: a scene, or the part of a bearing in the scene of a building."""

    @property
    def effects(self) -> Effects | Auto:
        """The effects that are given, or `Auto`."""

    @property
    def solver(self) -> Solver:
        """Options of the solver."""

    @property
    def end(self) -> float:
        """End of the run [s]."""


class Ending(NamedTuple):
    """How a run with one model ended, or a part of it.

    effects: of the model. status: name. time: reached [s]. surface, value: of the status; surface 0: none. trips: of
    the monitors, name -> (time of the first detection, surface, value, time of the value).
    """

    effects: Effects
    status: str
    time: float
    surface: int
    value: float
    trips: Mapping[str, tuple[float, int, float, float]]


def check_effects(scene: Requested, effects: Effects) -> None:
    """Raise InputError where the method of the scene does not support these effects."""
    if effects.sliders == "massless" and scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': massless sliders have no accelerations to integrate; use 'implicit'"
        )
    if effects.uplift and scene.solver.method == "dopri5":
        raise InputError(
            "solver.method = 'dopri5': the equations of PEER 2017/07 have no separation; use 'implicit' with uplift"
        )


def stopping_monitors(scene: Requested, effects: Effects, strict: bool) -> tuple[str, ...]:
    """The monitors that stop a run with these effects; the others only write notes.

    strict: all monitors, except the one of uplift where the scene gives `Effects`. Otherwise the monitors after which
    the run can continue with a model that includes the effect.
    """
    if strict:
        return MONITORS if isinstance(scene.effects, Auto) else tuple(name for name in MONITORS if name != "uplift")
    return tuple(name for name in MONITORS if _extended(scene, effects, name) is not None)


def next_effects(scene: Requested, ending: Ending) -> Effects | None:
    """The effects with which a run continues; None where it has ended."""
    effects, status = ending.effects, ending.status
    if status == "ok" and ending.time < scene.end:
        return _extended(scene, effects, "plane")
    if status == "uplift":
        return _extended(scene, effects, "uplift")
    if status in JAM_STATUSES:
        return _extended(scene, effects, "inertia") or _extended(scene, effects, "uplift")
    if status != "monitor":
        return None
    extended = effects
    for name in stopping_monitors(scene, effects, strict=False):  # several may have tripped in the same step
        if name in ending.trips:
            extended = _extended(scene, extended, name) or extended
    return extended


def all_effects(scene: SceneFields) -> Effects:
    """The effects of a scene if nothing is left to monitors: every effect that one of them may add is modelled.

    Effects with a field that the scene fixes stay as they are, and so does a friction law without further parameters.
    """
    requested = scene.effects
    if isinstance(requested, Effects):
        return requested
    effects = requested.resolve(friction=scene.law[0], top_rotation=(scene.top_rotation is not None) or None)
    return with_monitored(scene, effects)


def with_monitored(scene: Requested, effects: Effects) -> Effects:
    """Effects extended by all that monitors may add."""
    for name in REQUIRED_EFFECTS:
        effects = _extended(scene, effects, name) or effects
    return effects


def _extended(scene: Requested, effects: Effects, name: str) -> Effects | None:
    """Effects extended by those that the monitor `name` requires."""
    # None where the scene fixes one of them, the method does not support it, or the model has them already.
    requested = scene.effects
    if not isinstance(requested, Auto) or ("uplift" in REQUIRED_EFFECTS[name] and scene.solver.method == "dopri5"):
        return None
    if name == "heat" and effects.friction != "pv":  # the surfaces have no thermal parameters
        return None
    needed = {key: value for key, value in REQUIRED_EFFECTS[name].items() if getattr(effects, key) != value}
    if not needed or any(getattr(requested, key) is not None for key in needed):
        return None
    return replace(effects, **needed)  # type: ignore[arg-type]


NOTED_SOFTENING = 0.05  # relative change of friction by heat that is noted where the law has no temperature


def _significant_rise(scene: SceneFields, effects: Effects, selection: EffectSelection) -> float:
    """Temperature rise at which the monitor of heat trips [K]; see `thermal_softening`."""
    softening = thermal_softening(effects.law, scene.bearing)
    change = selection.error if effects.friction == "pv" else NOTED_SOFTENING
    return change / softening if softening > 0 else 0.0


def monitor_options(
    scene: SceneFields,
    effects: Effects,
    selection: EffectSelection,
    stops: tuple[str, ...],
    noted: tuple[str, ...] = (),
) -> dict[str, Any]:
    """Monitors of everything that the model leaves out, and their limits, as arguments of the compiled run.

    stops: the monitors that stop it. noted: "uplift", where a load below its limit is to be noted without them.
    """
    heats = effects.law is not None and effects.law.depends_on_temperature
    stack = scene.fidelity != "equivalent"  # bodies and surfaces of one pendulum are none of the device
    left_out = {
        "rims": not effects.rims,
        "uplift": "uplift" in (*stops, *noted) and not effects.uplift,
        "footprint": not effects.uplift and stack,
        "inertia": effects.sliders == "massless" and stack,
        "heat": not heats and stack,
    }
    checked = checked_range(effects.law, scene.bearing, lower_load_limit=not effects.uplift)
    left_out |= {name: name in checked for name in ("law_speed", "law_load", "law_temperature")}
    heating, reach = np.array(heated_contacts(scene.bearing)).T
    return checked | {
        "monitors": tuple(name for name, out in left_out.items() if out),
        "monitor_stop": tuple(stops),
        "monitor_normal": UPLIFT_MONITOR_SHARE * load_at_rest(scene),
        "monitor_peak": rigid_mass_limit(scene),
        "monitor_inertia": inertia_limit(scene, selection.error),
        "monitor_time": slider_period(scene.bearing, load_at_rest(scene)),
        "monitor_rise": _significant_rise(scene, effects, selection),
        "monitor_heating": np.ascontiguousarray(heating),
        "monitor_reach": np.ascontiguousarray(reach),
    }
