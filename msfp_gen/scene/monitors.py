"""Monitors of a run: what its model leaves out, and the limits beyond which that matters (docs/effects.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.scene.effect_selection import (
    UPLIFT_MONITOR_SHARE,
    EffectSelection,
    inertia_limit,
    load_at_rest,
    rigid_mass_limit,
    slider_period,
)
from msfp_gen.scene.friction_parameters import checked_range, heated_contacts, thermal_softening

if TYPE_CHECKING:
    from msfp_gen.scene.parts import SceneParts
    from msfp_gen.specification.layout import Effects

NOTED_SOFTENING = 0.05  # relative change of friction by heat that is noted where the law has no temperature


def _significant_rise(scene: SceneParts, effects: Effects, selection: EffectSelection) -> float:
    """Temperature rise at which the monitor of heat trips [K]; see `thermal_softening`."""
    softening = thermal_softening(effects.law, scene.bearing)
    change = selection.error if effects.friction == "pv" else NOTED_SOFTENING
    return change / softening if softening > 0 else 0.0


def monitor_options(
    scene: SceneParts, effects: Effects, selection: EffectSelection, stops: tuple[str, ...], noted: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Monitors of everything that the model leaves out, and their limits, as arguments of the compiled run.

    stops: the monitors that stop it. noted: "uplift", where a load below its limit is to be noted without them.
    """
    heats = effects.law is not None and effects.law.depends_on_temperature
    left_out = {
        "rims": not effects.rims,
        "uplift": "uplift" in (*stops, *noted) and not effects.uplift,
        "inertia": effects.sliders == "massless",
        "heat": not heats,
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
        "monitor_time": slider_period(scene),
        "monitor_rise": _significant_rise(scene, effects, selection),
        "monitor_heating": np.ascontiguousarray(heating),
        "monitor_reach": np.ascontiguousarray(reach),
    }
