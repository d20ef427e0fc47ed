"""`BuildingBearing`: a bearing below a building, with its joint, its place and its effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields, require_type
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.friction_parameters import select_friction
from msfp_gen.scene.standing import needed_rotational_stiffness
from msfp_gen.scene.top import NodeTop
from msfp_gen.specification.friction_laws import Law, law_of
from msfp_gen.specification.layout import Auto, Effects


@dataclass(frozen=True)
class BuildingBearing:
    """A bearing of a building.

    bearing: values, which several bearings of a building may share. interface: `Top.node(...)`, the joint: stiffness
    and damping between top plate and building. position: in plan [m]; None: the position of the node, for a floor its
    centre of mass. node: of the building; a rigid link connects the bearing to it. effects: of the model; `Auto` or
    None: selected from the scene. name: for messages and results. motion: of the ground below the bearing; None: of the
    scene. Raises InputError.
    """

    bearing: Bearing
    interface: NodeTop
    position: Annotated[tuple[float, float] | None, Quantity("m", shape=(2,))] = None
    node: str = "base"
    effects: Effects | Auto | None = None
    name: str = ""
    motion: Motion | None = None

    def __post_init__(self) -> None:
        require_type(self.bearing, Bearing, "building_bearing.bearing")
        require_type(self.motion, (Motion, type(None)), "building_bearing.motion")
        require_type(self.interface, NodeTop, "building_bearing.interface")
        require_type(self.effects, (Effects, Auto, type(None)), "building_bearing.effects")
        check_fields(self, "building_bearing")
        for name, needed in (("dimension", "spatial"), ("spin", "locked")):
            if (value := getattr(self.effects, name, None)) not in (None, needed):
                raise InputError(
                    f"building_bearing.effects.{name} = {value!r}: a building moves its bearings in space and twists "
                    f"none of them; give {needed!r}"
                )

    @property
    def law(self) -> Law | None:
        """The friction law at the start of a run; None: friction is constant."""
        requested = self.effects or Auto()
        formula = requested.friction_law
        return law_of(requested.friction or select_friction(self.bearing, formula), formula)


def standing_below(mount: BuildingBearing, load: float) -> tuple[float, float, float]:
    """Rotational stiffness of an interface [N m/rad], the stiffness that its plate needs [N m/rad], and the load [N].

    For the checks of `scene/standing.py`. The building holds no plate at its place but follows it sideways.
    """
    weight = float(load)
    return mount.interface.rotational_stiffness, needed_rotational_stiffness(mount.bearing, weight, 0.0), weight
