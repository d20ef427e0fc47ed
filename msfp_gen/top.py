"""What stands on the top plate. `Top.rig`, `Top.prescribed` and `Top.mass` make one; `kind` tells which it is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from msfp_gen.errors import InputError
from msfp_gen.fields import Quantity, check_fields

_ROTATIONAL_STIFFNESS = Quantity("N m/rad", least=0.0)
_ROTATIONAL_DAMPING = Quantity("N m s/rad", least=0.0)


@dataclass(frozen=True)
class Top:
    """Base of the three kinds of top; make one with `Top.rig`, `Top.prescribed` or `Top.mass`."""

    kind: ClassVar[str] = ""

    def __post_init__(self) -> None:
        if not self.kind:
            raise InputError("top = Top(): give Top.rig(...), Top.prescribed(...) or Top.mass(...)")
        check_fields(self, "top")

    @staticmethod
    def rig(
        axial_load: float,
        stiffness: float,
        damping: float = 0.0,
        rotational_stiffness: float = 0.0,
        rotational_damping: float = 0.0,
    ) -> RigTop:
        """The testing machine of chapter 4; see `RigTop`."""
        return RigTop(axial_load, stiffness, damping, rotational_stiffness, rotational_damping)

    @staticmethod
    def prescribed(
        force: tuple[float, float, float], moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> PrescribedTop:
        """A constant force and moment on the top plate; see `PrescribedTop`."""
        return PrescribedTop(force, moment)

    @staticmethod
    def mass(
        mass: float,
        inertia: tuple[float, float] | float,
        height: float,
        rotational_stiffness: float = 0.0,
        rotational_damping: float = 0.0,
    ) -> MassTop:
        """A rigid supported mass; see `MassTop`."""
        return MassTop(mass, inertia, height, rotational_stiffness, rotational_damping)


@dataclass(frozen=True)
class RigTop(Top):
    """A rig: constant axial load, and springs that hold the middle of the top plate (chapter 4 of the report).

    axial_load: downward [N]. stiffness, damping: along E1 and E2 [N/m], [N s/m].
    rotational_stiffness, rotational_damping: against tilt and spin [N m/rad], [N m s/rad]. Raises InputError.
    """

    kind: ClassVar[str] = "rig"
    axial_load: Annotated[float, Quantity("N", least=0.0)]
    stiffness: Annotated[float, Quantity("N/m", least=0.0)]
    damping: Annotated[float, Quantity("N s/m", least=0.0)] = 0.0
    rotational_stiffness: Annotated[float, _ROTATIONAL_STIFFNESS] = 0.0
    rotational_damping: Annotated[float, _ROTATIONAL_DAMPING] = 0.0


@dataclass(frozen=True)
class PrescribedTop(Top):
    """Constant F_top [N] and M_top [N m] on the top plate at r_nn, along E1, E2, E3 (3.28), (3.29)."""

    kind: ClassVar[str] = "prescribed"
    force: Annotated[tuple[float, float, float], Quantity("N", shape=(3,))]
    moment: Annotated[tuple[float, float, float], Quantity("N m", shape=(3,))] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MassTop(Top):
    """A rigid mass fixed to the top plate.

    mass [kg]. inertia: (transverse, axial) about its centre, or one number for both [kg m^2].
    height: of its centre above the top of the top plate, r_nn [m].
    rotational_stiffness, rotational_damping: what resists its tilt, such as its neighbours [N m/rad], [N m s/rad].
    Raises InputError.
    """

    kind: ClassVar[str] = "mass"
    # field() keeps the inherited constructor Top.mass from being taken for a default.
    mass: Annotated[float, Quantity("kg", above=0.0)] = field()  # type: ignore[assignment]
    inertia: Annotated[tuple[float, float] | float, Quantity("kg m^2", above=0.0, shape=(2,), pair=True)]
    height: Annotated[float, Quantity("m", least=0.0)]
    rotational_stiffness: Annotated[float, _ROTATIONAL_STIFFNESS] = 0.0
    rotational_damping: Annotated[float, _ROTATIONAL_DAMPING] = 0.0
