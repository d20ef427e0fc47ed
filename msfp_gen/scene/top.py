"""The structure on the top plate: a rig, a prescribed load, a supported mass, or a node of another program."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Quantity, check_fields, paired
from msfp_gen.specification import contract
from msfp_gen.specification.values import rules

_TOP = rules(contract.TOP)
_MASS = _TOP | rules(contract.TOP_MASS)
_INTERFACE = _TOP | rules(contract.INTERFACE)


@dataclass(frozen=True)
class Top:
    """Base class of the kinds of top, which `Top.rig`, `Top.prescribed`, `Top.mass` and `Top.node` make.

    kind: "rig", "prescribed" or "mass", as in scene files; "node" of a `TwoPort`.
    """

    kind: ClassVar[str] = ""
    # Springs that a kind of top does not have; a kind that has one has a field of this name. Without field(), such a
    # field would take the inherited value, and `mass` the static method, as its default.
    stiffness = 0.0
    rotational_stiffness = 0.0
    rotational_damping = 0.0
    vertical_stiffness = 0.0

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
        vertical_stiffness: float = 0.0,
        vertical_damping: float = 0.0,
    ) -> RigTop:
        """A test rig as in chapter 4 of PEER 2017/07; see `RigTop`."""
        restraint = (stiffness, damping, rotational_stiffness, rotational_damping)
        return RigTop(axial_load, *restraint, vertical_stiffness, vertical_damping)

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
        vertical_stiffness: float | None = None,
        vertical_damping: float = 0.0,
    ) -> MassTop:
        """A rigid supported mass; see `MassTop`."""
        restraint = (rotational_stiffness, rotational_damping)
        return MassTop(mass, inertia, height, *restraint, vertical_stiffness, vertical_damping)

    @staticmethod
    def node(
        stiffness: float,
        vertical_stiffness: float,
        rotational_stiffness: float,
        damping: float = 0.0,
        vertical_damping: float = 0.0,
        rotational_damping: float = 0.0,
    ) -> NodeTop:
        """The interface to a node that another program moves; see `NodeTop`."""
        stiffnesses = (stiffness, vertical_stiffness, rotational_stiffness)
        return NodeTop(*stiffnesses, damping, vertical_damping, rotational_damping)


@dataclass(frozen=True)
class RigTop(Top):
    """A test rig: constant axial load, springs and dampers at the centre of the top plate (PEER 2017/07, chapter 4).

    axial_load: downward [N]. stiffness, damping: k_top, c_top along E1 and E2 [N/m], [N s/m].
    rotational_stiffness, rotational_damping: against tilt and spin [N m/rad], [N m s/rad]. vertical_stiffness,
    vertical_damping: of a rig that holds its height, in addition to the axial load, without force at the height of the
    start [N/m], [N s/m]; 0: the load alone. Raises InputError.
    """

    kind: ClassVar[str] = "rig"
    axial_load: Annotated[float, contract.AXIAL_LOAD.rule]
    stiffness: Annotated[float, _TOP["stiffness"]] = field()
    damping: Annotated[float, _TOP["damping"]] = 0.0
    rotational_stiffness: Annotated[float, _TOP["rotational_stiffness"]] = 0.0
    rotational_damping: Annotated[float, _TOP["rotational_damping"]] = 0.0
    vertical_stiffness: Annotated[float, _TOP["vertical_stiffness"]] = 0.0
    vertical_damping: Annotated[float, _TOP["vertical_damping"]] = 0.0


@dataclass(frozen=True)
class PrescribedTop(Top):
    """Constant F_top [N] and M_top [N m] on the top plate at r_nn, along E1, E2, E3 (3.28), (3.29)."""

    kind: ClassVar[str] = "prescribed"
    force: Annotated[tuple[float, float, float], Quantity("N", shape=(3,))]
    moment: Annotated[tuple[float, float, float], Quantity("N m", shape=(3,))] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MassTop(Top):
    """A rigid supported mass fixed to the top plate, or resting on it through a vertical spring.

    mass [kg]. inertia: (transverse, axial) about the centre of mass, or one value for both [kg m^2].
    height: of the centre of mass above the upper face of the top plate, r_nn [m].
    rotational_stiffness, rotational_damping: restraint against tilt, for example by the remaining structure
    [N m/rad], [N m s/rad]. vertical_stiffness, vertical_damping: between top plate and mass, of bearing and columns, k
    and c of docs/model.md [N/m], [N s/m]; None or 0: rigid. At the start the spring carries the weight at rest. Raises
    InputError.
    """

    kind: ClassVar[str] = "mass"
    mass: Annotated[float, _MASS["mass"]] = field()  # type: ignore[assignment]
    inertia: Annotated[tuple[float, float] | float, paired(_MASS["inertia_transverse"])]
    height: Annotated[float, _MASS["height"]]
    rotational_stiffness: Annotated[float, _MASS["rotational_stiffness"]] = 0.0
    rotational_damping: Annotated[float, _MASS["rotational_damping"]] = 0.0
    vertical_stiffness: Annotated[float | None, _MASS["vertical_stiffness"]] = None  # type: ignore[assignment]
    vertical_damping: Annotated[float, _MASS["vertical_damping"]] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.vertical_stiffness == 0.0:  # no spring, as a rig may have none
            object.__setattr__(self, "vertical_stiffness", None)
        if self.vertical_damping and self.vertical_stiffness is None:
            raise InputError(
                f"top.vertical_damping = {self.vertical_damping!r}: a damper alone carries no weight; give "
                "top.vertical_stiffness as well"
            )


@dataclass(frozen=True)
class NodeTop(Top):
    """The interface of a `TwoPort`: springs and dampers between the top plate and a node that another program moves.

    stiffness, damping: along E1 and E2 [N/m], [N s/m]; vertical_stiffness, vertical_damping: along E3, of steel, liner
    and column head; rotational_stiffness, rotational_damping: against tilt relative to the node [N m/rad],
    [N m s/rad]. The springs keep their directions while the node rotates. Raises InputError.
    """

    kind: ClassVar[str] = "node"
    stiffness: Annotated[float, _INTERFACE["stiffness"]] = field()
    vertical_stiffness: Annotated[float, _INTERFACE["vertical_stiffness"]] = field()
    rotational_stiffness: Annotated[float, _INTERFACE["rotational_stiffness"]] = field()
    damping: Annotated[float, _INTERFACE["damping"]] = 0.0
    vertical_damping: Annotated[float, _INTERFACE["vertical_damping"]] = 0.0
    rotational_damping: Annotated[float, _INTERFACE["rotational_damping"]] = 0.0


def is_sprung(top: Top) -> bool:
    """Whether a vertical spring or damper acts on the top plate."""
    return isinstance(top, RigTop | MassTop) and bool(top.vertical_stiffness or top.vertical_damping)


def sprung_mass(top: Top) -> float:
    """Supported mass that rests on a vertical spring [kg]."""
    return top.mass if isinstance(top, MassTop) and is_sprung(top) else 0.0


def load_values(top: Top) -> Array:
    """Constant force [N] and moment [N m] of the top on the top plate at r_nn, ndarray, shape (6,)."""
    if isinstance(top, RigTop):
        return np.array([0.0, 0.0, -top.axial_load, 0.0, 0.0, 0.0])
    if isinstance(top, PrescribedTop):
        return np.array([*top.force, *top.moment], dtype=float)
    return np.zeros(6)
