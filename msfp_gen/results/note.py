"""`Note`: the message of a monitor."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Note:
    """Message of a monitor, in one line.

    time [s]: of the first detection. kind: "rims", "uplift", "inertia", "heat", "law_speed", "law_load",
    "law_temperature", "plane", "jammed", "energy", "tolerance", "damping", "creep", "peak", "rattle", "footprint",
    "ringing", "gradient" or "value". surface: 1..n-1; 0: none. value: what the text gives, of a monitor the one
    furthest beyond its limit: distance beyond the capacity [m], force [N], inertial over normal force [-], temperature
    rise [K], slip velocity [m/s], temperature [degC], share of the energy [-], movement [m], distance of the normal
    force from the axis [m], number of landings, error over the derivative [-], value of the scene. action: the effects
    with which the run continued; "": it continued unchanged, or ended.
    """

    time: float
    kind: str
    surface: int
    value: float
    text: str
    action: str = ""

    @property
    def line(self) -> str:
        """Time, text and action."""
        return f"t = {self.time:.6g} s: {self.text}" + (f"; continued with {self.action}" if self.action else "")
