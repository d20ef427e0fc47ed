"""The checks of an audit: one function for each, over one table. Each is a physical statement about a bearing."""

from __future__ import annotations

from collections.abc import Callable

from msfp_gen.auditing import friction, mechanics, recording
from msfp_gen.auditing.case import Answer, AuditCase

Check = Callable[[AuditCase], Answer]
CHECKS: dict[str, tuple[str, Check]] = {
    "signs": ("signs of force, displacement and axial force", recording.signs),
    "units": ("units", recording.units),
    "sampling": ("distance of rows", recording.sampling),
    "clipped": ("values cut off", recording.clipped),
    "weight": ("weight on the bearings", mechanics.weight),
    "mass": ("inertia: shear over acceleration", mechanics.mass),
    "vertical_mass": ("inertia: axial force over vertical acceleration", mechanics.vertical_mass),
    "tension": ("tension", mechanics.tension),
    "friction_bound": ("force within friction and curvature", friction.friction_bound),
    "friction": ("friction coefficient while sliding", friction.friction),
    "radius": ("curvature", friction.radius),
    "heat": ("heat", friction.heat),
    "coupling": ("horizontal force follows the axial force", friction.coupling),
    "damping": ("force along the velocity", friction.damping),
    "energy": ("energy", mechanics.energy),
    "chatter": ("chatter and spikes", friction.chatter),
    "travel": ("travel", mechanics.travel),
    "lift": ("rise on the dish", mechanics.lift),
}
"""Key of a check -> its title, and its function; in the order of tables."""
