"""Effects of each bearing of a building: their selection (docs/effects.md), and vibrations on its interfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.scene.effect_selection import GIVEN, LEAST_DAMPING, USUAL_DAMPING, EffectSelection, Reason, ringing
from msfp_gen.scene.friction_parameters import select_friction
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.buildings.building import Building
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.top import NodeTop

LEAST_SHARE = 0.1  # of the load at rest that an estimate must leave for uplift to be left out
STEP = 5e-3  # of the linear response [s]
SMALL = 1e-12  # of a mode that vertical motion does not excite
SHARE = 0.2  # of the strain energy of a mode, in the interfaces, above which these can damp it


class _Supported(Protocol):
    """A bearing of a building: what decides its effects."""

    @property
    def bearing(self) -> Bearing: ...
    @property
    def interface(self) -> NodeTop: ...
    @property
    def effects(self) -> Effects | Auto | None: ...
    @property
    def motion(self) -> Motion | None: ...


class _OnBearings(Protocol):
    """A building on bearings: what decides their effects."""

    @property
    def building(self) -> Building: ...
    @property
    def bearings(self) -> Sequence[_Supported]: ...
    @property
    def motion(self) -> Motion: ...
    @property
    def end(self) -> float: ...
    @property
    def gravity(self) -> float: ...
    @property
    def attachments(self) -> Array: ...
    @property
    def axial_loads(self) -> Array: ...
    @property
    def vertical_modes(self) -> VerticalModes: ...


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


def vertical_modes(scene: _OnBearings) -> VerticalModes:
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


def undamped(scene: _OnBearings, modes: VerticalModes) -> Iterator[tuple[int, float, str]]:
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


def select_effects(scene: _OnBearings) -> tuple[EffectSelection, ...]:
    """The effects of every bearing: as given, or selected. Raises InputError where they exclude each other."""
    if all(isinstance(each.effects, Effects) for each in scene.bearings):
        remaining: list[float] = [0.0] * len(scene.bearings)  # nothing is selected
    elif any(_ground(scene, each) != _ground(scene, scene.bearings[0]) for each in scene.bearings):
        remaining = [-np.inf] * len(scene.bearings)  # the estimate has one motion of the ground
    else:
        remaining = remaining_loads(scene).tolist()
    return tuple(_selected(scene, index, share) for index, share in enumerate(remaining))


def _selected(scene: _OnBearings, index: int, remaining: float) -> EffectSelection:
    given = scene.bearings[index]
    requested = Auto() if given.effects is None else given.effects
    if isinstance(requested, Effects):
        return EffectSelection(requested)
    reasons = tuple(
        Reason(reason.effect, value, GIVEN) if (value := getattr(requested, reason.effect)) is not None else reason
        for reason in _reasons(given.bearing, requested, remaining)
    )
    try:
        effects = requested.resolve(**{reason.effect: reason.chosen for reason in reasons})
    except InputError as error:
        raise InputError(f"scene.bearings[{index}].{error}") from None
    return EffectSelection(effects, reasons, error=requested.error)


def _reasons(bearing: Bearing, requested: Auto, remaining: float) -> tuple[Reason, ...]:
    """The selection of every effect that `Auto` leaves open. remaining: as of `remaining_loads`; -inf: not known."""
    capacity = min(surface.capacity for surface in bearing.surfaces)
    friction = select_friction(bearing, requested.friction_law)
    lifts = remaining <= LEAST_SHARE and requested.sliders != "massless"
    left = f"about {max(remaining, 0.0):.0%} of the load at rest remains"
    if remaining == -np.inf:
        left = "the ground moves differently below some bearings, which may take the load off others"
    saves = "" if lifts else f"{3 * bearing.layout.surfaces} unknown separations"
    return (
        Reason("dimension", "spatial", "the building moves a bearing in space"),
        Reason("sliders", "inertial", "quasi-static steps need motion in one vertical plane"),
        Reason("rims", True, f"nothing limits sliding under a building; the least capacity is {1e3 * capacity:.4g} mm"),
        Reason("uplift", lifts, left, saves),
        Reason("friction", friction, "the parameters that its surfaces have"),
    )


def _ground(scene: _OnBearings, bearing: _Supported) -> Motion:
    """The motion of the ground below a bearing."""
    return scene.motion if bearing.motion is None else bearing.motion


def remaining_loads(scene: _OnBearings) -> Array:
    """An estimate of the least axial load of every bearing over that at rest, ndarray, shape (bearings,).

    The ground moves as below the first bearing. Vertically the response of the linear building on the springs of its
    interfaces; beyond that it overturns as a rigid body under the horizontal force of its bearings where all surfaces
    slide, at the largest distance of the ground from its start.
    """
    times = np.arange(0.0, scene.end, STEP)
    path = _ground(scene, scene.bearings[0]).displacement(times)[:, :2]
    overturning = _overturning(scene, float(np.linalg.norm(path - path[0], axis=1).max()))
    found: Array = 1.0 + (_vertical_response(scene, times).min(axis=0) - overturning) / scene.axial_loads
    return found


def _vertical_response(scene: _OnBearings, times: Array) -> Array:
    """Change of the axial loads under the vertical motion of the ground, shape (times, bearings) [N].

    By superposition of modes, each with its share of the damping, exact for an acceleration that is linear in a step.
    """
    from scipy.signal import cont2discrete, lfilter

    building, rows = scene.building, scene.attachments[:, 2]
    springs = np.array([each.interface.vertical_stiffness for each in scene.bearings])
    dampers = np.array([each.interface.vertical_damping for each in scene.bearings])
    squares, modes, rates, _ = scene.vertical_modes
    part = -modes.T @ building.mass @ building.rigid_motions[:, 2]
    ground = _ground(scene, scene.bearings[0]).acceleration(times)[:, 2]
    loads = np.zeros((len(times), len(rows)))
    for mode, square, rate, force in zip(modes.T, squares, rates, part, strict=True):
        along = rows @ mode
        if abs(force) * np.abs(along).max() < SMALL * np.abs(building.mass @ mode).max():
            continue
        for weight, numerator in ((springs, [force]), (dampers, [force, 0.0])):
            above, below, _ = cont2discrete((numerator, [1.0, rate, square]), STEP, "foh")
            loads -= np.outer(lfilter(above[0], below, ground), weight * along)
    return loads


def _overturning(scene: _OnBearings, distance: float) -> Array:
    """Largest change of the axial loads by overturning, shape (bearings,) [N]. distance: of the ground [m]."""
    share = max(_force_share(each.bearing, distance) for each in scene.bearings)
    motions = scene.building.rigid_motions
    moment = share * scene.gravity * float(np.abs((motions.T @ scene.building.mass @ motions)[0, 4]))
    springs = np.array([each.interface.vertical_stiffness for each in scene.bearings])
    arms = scene.attachments[:, 2] @ motions[:, 3:5]
    arms -= springs @ arms / springs.sum()
    rocking = springs @ arms**2
    changes = np.divide(moment * springs[:, None] * arms, rocking, where=rocking > 0, out=np.zeros_like(arms))
    largest: Array = np.hypot(*changes.T)
    return largest


def _force_share(bearing: Bearing, distance: float) -> float:
    """Horizontal force over the load of a bearing whose surfaces all slide, by that distance in all [-]."""
    return max(surface.friction for surface in bearing.surfaces) + distance / sum(s.radius for s in bearing.surfaces)
