"""Vibrations of a building on the vertical springs of its interfaces: modes, and a doubt where they ring on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.scene.effect_selection import LEAST_DAMPING, USUAL_DAMPING, ringing

if TYPE_CHECKING:
    from msfp_gen.buildings.building import Building
    from msfp_gen.scene.top import NodeTop

SHARE = 0.2  # of the strain energy of a mode, in the interfaces, above which these can damp it


class _Supported(Protocol):
    """A bearing of a building: its interface."""

    @property
    def interface(self) -> NodeTop: ...


class _OnInterfaces(Protocol):
    """A building on bearings: its matrices, and what is below it."""

    @property
    def building(self) -> Building: ...
    @property
    def bearings(self) -> Sequence[_Supported]: ...
    @property
    def attachments(self) -> Array: ...


class VerticalModes(NamedTuple):
    """Modes of a building whose bearings resist vertical motion alone, with n modes and coordinates.

    squares: of circular frequencies, shape (n,) [1/s^2]. shapes: columns, of unit modal mass. rates: twice the damping
    ratio times the circular frequency, shape (n,) [1/s]. shares: of the strain energy that the springs of the
    interfaces have, shape (n,).
    """

    squares: Array
    shapes: Array
    rates: Array
    shares: Array


def vertical_modes(scene: _OnInterfaces) -> VerticalModes:
    """The modes of a building on the vertical springs and dampers of its interfaces."""
    from scipy.linalg import eigh

    building, rows = scene.building, scene.attachments[:, 2]
    springs, dampers = (
        rows.T * [getattr(each.interface, name) for each in scene.bearings] @ rows
        for name in ("vertical_stiffness", "vertical_damping")
    )
    squares, shapes = eigh(building.stiffness + springs, building.mass)
    rates, stored = (
        np.einsum("im,ij,jm->m", shapes, matrix, shapes) for matrix in (building.damping + dampers, springs)
    )
    squares = np.maximum(squares, 0.0)
    return VerticalModes(squares, shapes, rates, stored / np.maximum(squares, 1e-9 * squares.max()))


def undamped(scene: _OnInterfaces, modes: VerticalModes) -> Iterator[tuple[int, float, str]]:
    """A doubt where a mode that the interfaces could damp has less than `LEAST_DAMPING` of critical damping.

    Yields 0 (no surface), the least damping ratio and the text with the damping that cures it.
    """
    on_springs = modes.shares > SHARE
    if not on_springs.any():
        return
    turns = np.sqrt(modes.squares[on_springs])
    ratios = modes.rates[on_springs] / (2 * turns)
    least, interface = int(ratios.argmin()), scene.bearings[0].interface
    if ratios[least] < LEAST_DAMPING:
        missing = 2 * (USUAL_DAMPING - ratios) / (turns * modes.shares[on_springs])  # damping over stiffness [s]
        given = interface.vertical_damping
        cure = given + float(missing.max()) * interface.vertical_stiffness
        what = "the building vibrates on the vertical springs of its interfaces"
        name = "building.interface.vertical_damping"
        yield 0, float(ratios[least]), ringing(name, given, what, turns[least], ratios[least], cure)
