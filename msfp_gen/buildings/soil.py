"""`Soil`: springs and dampers of the ground below a bearing (docs/buildings.md)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from msfp_gen.common.fields import Quantity, check_fields, require_type
from msfp_gen.errors import InputError
from msfp_gen.scene.top import NodeTop

# What a soil of this model does not have -> the reason and the remedy.
REFUSED = {
    "rotational_stiffness": "the lower plate of a bearing does not tilt with its foundation; leave it out: a building "
    "rocks on the vertical springs below its bearings",
    "mass": "a foundation between soil and bearing has no inertia; leave it out, or compute its motion elsewhere and "
    "give that as the motion of the bearings",
}


@dataclass(frozen=True)
class Soil:
    """Springs and dampers of the ground below one bearing, along E1 and E2, and along E3.

    stiffness, vertical_stiffness [N/m]; damping, vertical_damping [N s/m]. rotational_stiffness [N m/rad] and mass of a
    foundation [kg] are not modelled: giving them raises InputError, which says why.
    """

    stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    vertical_stiffness: Annotated[float, Quantity("N/m", above=0.0)]
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    vertical_damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    rotational_stiffness: Annotated[float | None, Quantity("N m/rad", above=0.0)] = None
    mass: Annotated[float | None, Quantity("kg", above=0.0)] = None

    def __post_init__(self) -> None:
        check_fields(self, "soil")
        for name, reason in REFUSED.items():
            if (value := getattr(self, name)) is not None:
                raise InputError(f"soil.{name} = {value:g}: {reason}")

    def below(self, interface: NodeTop) -> NodeTop:
        """The interface of a bearing on this soil: both in series.

        A bearing is light beside what it carries, so the same force passes through both, in either order. Dampers: the
        energy that both lose in slow motion; exact where damping over stiffness is the same of both. Raises InputError.
        """
        require_type(interface, NodeTop, "interface")
        along = _in_series(interface.stiffness, interface.damping, self.stiffness, self.damping)
        upright = _in_series(
            interface.vertical_stiffness, interface.vertical_damping, self.vertical_stiffness, self.vertical_damping
        )
        return replace(
            interface,
            stiffness=along[0],
            damping=along[1],
            vertical_stiffness=upright[0],
            vertical_damping=upright[1],
        )


def _in_series(k1: float, c1: float, k2: float, c2: float) -> tuple[float, float]:
    """Stiffness and damping of two springs in series, each with a damper beside it; to first order in frequency."""
    stiffness = k1 / (1 + k1 / k2)
    return stiffness, c1 * (stiffness / k1) ** 2 + c2 * (stiffness / k2) ** 2
