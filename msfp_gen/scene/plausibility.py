"""Values that are hardly meant: a table of checks, each with its usual range, and the notes on a scene that follow.

A value beyond its usual range gives a note with field, value and remedy; one beyond the wider range, such as by a unit
that is off by a thousand, is refused by the command line unless it is told to run (`refusals`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import singledispatch
from itertools import pairwise
from math import inf, pi
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import G
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.sources import ACCELERATION_SAMPLES
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.effect_selection import load_at_rest
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.scene_fields import Limits, SceneFields
from msfp_gen.scene.standing import standing_of, unsteady
from msfp_gen.scene.top import MassTop, RigTop, Top, sprung_mass
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Auto, Effects

Doubt = tuple[int, float, str]  # number of the surface, 0: none; the value; the text
Interval = tuple[float, float]
LEAST_DAMPING = 0.01  # ratio of a vibration on vertical springs below which what it adds depends on the tolerance
USUAL_DAMPING = 0.02  # ratio that is named as the remedy
RADII = (0.05, 20.0)  # usual, of a surface [m]
RIM_LOAD = 1 / 3  # of the load at rest, which a rim must bear
SOFTEST_RIM = 0.5  # compression of a rim by this load, over the capacity
BARE_DIGITS = 3  # significant digits at most of a number that was given in m/s^2; "0.15 g" has seven there


class Subject(NamedTuple):
    """What is judged: a bearing with its load at rest [N], 0: not known or there are no rims, and what acts on it."""

    bearing: Bearing
    load: float = 0.0
    rims: bool = True
    limits: Limits | None = None
    top: Top | None = None


class Reading(NamedTuple):
    """A value to judge. number: of its surface or body, from 1; 0: none. measure: what the range is of."""

    number: int
    value: float
    measure: float
    words: dict[str, Any] = {}  # noqa: RUF012  # further names in the text; never changed


class UsualRange(NamedTuple):
    """A value, its usual range, and the text of the note outside of it.

    read: of a `Subject`, a motion, a target or a building. text: with {index} of surface or body from 0, {value},
    {measure} and the words of the reading. refused: range beyond which no unit can be right.
    """

    read: Callable[[Any], Iterator[Reading]]
    usual: Interval
    text: str
    refused: Interval = (-inf, inf)


def _of_surfaces(name: str, over: str = "") -> Callable[[Subject], Iterator[Reading]]:
    """Reads a field of every surface, and judges it over another field."""

    def read(subject: Subject) -> Iterator[Reading]:
        for number, surface in enumerate(subject.bearing.surfaces, start=1):
            value = getattr(surface, name)
            yield Reading(number, value, value / getattr(surface, over) if over else value)

    return read


def _tilt(subject: Subject) -> Iterator[Reading]:
    """Capacities over the radii of their surfaces, where these are usual [rad]."""
    for reading, surface in zip(_of_surfaces("capacity", "radius")(subject), subject.bearing.surfaces, strict=True):
        if RADII[0] <= surface.radius <= RADII[1]:
            yield reading


def _rim_stiffness(subject: Subject) -> Iterator[Reading]:
    for number, surface in enumerate(subject.bearing.surfaces, start=1):
        borne = SOFTEST_RIM * surface.capacity * surface.rim_stiffness
        if subject.rims and borne > 0:
            words = {"compressed": 1e3 * SOFTEST_RIM * surface.capacity, "load": subject.load}
            yield Reading(number, surface.rim_stiffness, RIM_LOAD * subject.load / borne, words)


def _pressure(subject: Subject) -> Iterator[Reading]:
    """The load at rest, judged by the pressure on the smallest face of a slider [MPa]."""
    radii = [subject.bearing.slider_rim_radius(index) for index in range(len(subject.bearing.surfaces))]
    if subject.load > 0 and min(radii) > 0:
        words = {"diameter": 2e3 * min(radii)}
        yield Reading(0, subject.load, subject.load / (pi * min(radii) ** 2) * 1e-6, words)


def _carried(subject: Subject) -> Iterator[Reading]:
    """What a bearing carries at rest, over the weight of its own bodies above the base."""
    own = subject.bearing.gravity * sum(body.mass for body in subject.bearing.bodies)
    if subject.load > 0 and own > 0:
        carried = subject.load - own
        yield Reading(0, carried, carried / own, {"own": own})


def _plates(subject: Subject) -> Iterator[Reading]:
    """Heights of the bodies over the radius of their surface, or the larger one of two."""
    bearing = subject.bearing
    for index, body in enumerate(bearing.bodies[:-1]):
        radius = max(surface.radius for surface in bearing.surfaces[index : index + 2])
        yield Reading(0, body.height, body.height / radius, {"path": f"bodies[{index}].height"})
    for name, height, surface in (("base_height", bearing.base_height, 0), ("", bearing.bodies[-1].height, -1)):
        path = name or f"bodies[{len(bearing.bodies) - 1}].height"
        yield Reading(0, height, height / bearing.surfaces[surface].radius, {"path": path})


def _sides(bearing: Bearing) -> Iterator[list[int]]:
    """Indices of the surfaces below and above the innermost body, each from the outside."""
    lower = bearing.layout.signs.count(1)
    count = len(bearing.surfaces)
    yield list(range(lower))
    yield list(range(count - 1, lower - 1, -1))


def _nested(subject: Subject) -> Iterator[Reading]:
    """Reach of each inner slider, its radius and capacity, over the radius of the slider in which it slides."""
    bearing = subject.bearing
    for side in _sides(bearing):
        for outer, inner in pairwise(side):
            plate, own = bearing.slider_rim_radius(outer), bearing.slider_rim_radius(inner)
            if plate > 0 and own > 0:
                reach = own + bearing.surfaces[inner].capacity
                body = bearing.slider(inner)
                yield Reading(body, own, reach / plate, {"reach": 1e3 * reach, "plate": 1e3 * plate, "s": inner + 1})


def _order(subject: Subject) -> Iterator[Reading]:
    """Radius of each inner surface over the radius of the one outside."""
    surfaces = subject.bearing.surfaces
    for side in _sides(subject.bearing):
        for outer, inner in pairwise(side):
            value, outside = surfaces[inner].radius, surfaces[outer].radius
            yield Reading(inner + 1, value, value / outside, {"outer": outer, "outside": outside})


def _gravity(subject: Subject) -> Iterator[Reading]:
    yield Reading(0, subject.bearing.gravity, subject.bearing.gravity)


def _of_load(subject: Subject) -> float:
    return subject.load


def _of_capacity(subject: Subject) -> float:
    return sum(surface.capacity for surface in subject.bearing.surfaces)


def _limits(name: str, over: Callable[[Subject], float] = lambda _: 1.0) -> Callable[[Subject], Iterator[Reading]]:
    """Reads a limit of the device, and judges it over the capacity of all surfaces together or the load at rest."""

    def read(subject: Subject) -> Iterator[Reading]:
        value, of = None if subject.limits is None else getattr(subject.limits, name), over(subject)
        if value is not None and of > 0:
            yield Reading(0, value, value / of, {"of": of})

    return read


def _remedy(motion: Motion) -> str:
    """What to check in the samples of an acceleration; "" for a motion that has none."""
    if "format" in motion.metadata:
        return "are the unit of the record and motion.scale right?"
    return "is the unit of its samples right?" if motion.metadata.get("source") == ACCELERATION_SAMPLES else ""


def _peak(motion: Motion) -> Iterator[Reading]:
    """Largest horizontal acceleration of samples, in g."""
    if remedy := _remedy(motion):
        peak = float(np.linalg.norm(motion.acceleration(motion.knots)[:, :2], axis=1).max())
        if peak > 0:
            yield Reading(0, peak, peak / G, {"remedy": remedy})


def _sampling(motion: Motion) -> Iterator[Reading]:
    """Median time between the samples of an acceleration [s]."""
    if _remedy(motion):
        step = float(np.median(np.diff(motion.knots)))
        yield Reading(0, step, step)


def _scale(motion: Motion) -> Iterator[Reading]:
    scale = float(motion.metadata.get("scale", 1.0))
    yield Reading(0, scale, abs(scale))


def _bare(target: Mapping[str, Any], path: str = "scale_to") -> Iterator[Reading]:
    """The acceleration of a target of scaling [m/s^2] that was given without a unit, over the least usual one."""
    for name, least in LEAST_TARGETS.items():
        value = target.get(name)
        if isinstance(value, float) and value == float(f"{value:.{BARE_DIGITS}g}"):
            yield Reading(0, value, value / least, {"path": f"{path}.{name}", "in_g": value / G})


def _bare_of_motion(motion: Motion) -> Iterator[Reading]:
    if "scaled_to" in motion.metadata:
        yield from _bare(motion.metadata, "motion.scale_to")


def _rig(subject: Subject) -> Iterator[Reading]:
    """Stiffness of the spring of a rig over the stiffness of the largest sphere under the load."""
    if isinstance(subject.top, RigTop) and subject.top.stiffness > 0 and subject.load > 0:
        own = subject.load / max(surface.radius for surface in subject.bearing.surfaces)
        yield Reading(0, subject.top.stiffness, subject.top.stiffness / own, {"own": own})


_S = "bearing.surfaces[{index}]"
OF_BEARING = (
    UsualRange(
        _of_surfaces("friction"),
        (-inf, 0.3),
        _S + ".friction = {value:g} is unusually high; a fraction is meant, not per cent",
    ),
    UsualRange(
        _of_surfaces("radius"),
        RADII,
        _S + f".radius = {{value:g}} m is outside {RADII[0]:g} to {RADII[1]:g} m; is it in metres?",
        (0.005, 200.0),
    ),
    UsualRange(
        _tilt,
        (0.002, 0.5),
        _S + ".capacity = {value:g} m tilts the slider by {measure:.2g} rad; is it the displacement along the surface, "
        "in metres?",
        (5e-4, inf),  # above a quarter turn it is an error
    ),
    UsualRange(
        _of_surfaces("yield_displacement", "capacity"),
        (-inf, 0.1),
        _S + ".yield_displacement = {value:g} m is more than a tenth of the capacity; usual are 0.1 to 1 mm",
        (-inf, 1.0),
    ),
    UsualRange(
        _rim_stiffness,
        (-inf, 1.0),
        _S
        + ".rim_stiffness = {value:g} N/m stops no slider: compressed by half the capacity, {compressed:.3g} mm, the "
        "rim bears less than a third of the load at rest, {load:.4g} N; is it in N/m, not in kN/mm?",
        (-inf, 10.0),
    ),
    UsualRange(
        _pressure,
        (1.0, 400.0),
        "the load at rest of {value:.4g} N is {measure:.3g} MPa on the smallest face of a slider, {diameter:.4g} mm "
        "wide; are axial_load or mass in N and kg, and the rim_radius of bodies in m?",
        (0.15, 5000.0),
    ),
    UsualRange(
        _carried,
        (2.0, inf),
        "the bearing carries {value:.4g} N, {measure:.2g} of the weight of its own bodies, {own:.4g} N; are axial_load "
        "or mass in N and kg?",
        (1.0, inf),
    ),
    UsualRange(
        _plates,
        (-inf, 0.7),
        "bearing.{path} = {value:g} m is {measure:.2g} of the radius of its surface; is it the height at the axis, in "
        "metres?",
        (-inf, 10.0),
    ),
    UsualRange(
        _nested,
        (-inf, 1.25),
        "bearing.bodies[{index}].rim_radius = {value:g} m: at the capacity of surface {s} this slider reaches "
        "{reach:.4g} mm from the axis of the one in which it slides, whose radius is {plate:.4g} mm; are the radii of "
        "the sliders in their order?",
    ),
    UsualRange(
        _order,
        (-inf, 1.0),
        _S + ".radius = {value:g} m exceeds the radius of the surface outside, surfaces[{outer}].radius = {outside:g} "
        "m; surfaces go from the bottom: are outer and inner ones, or m and p of the layout, exchanged?",
        (-inf, 30.0),
    ),
    UsualRange(
        _gravity,
        (9.7, 9.9),
        "bearing.gravity = {value:g} m/s^2 is far from 9.81; is it in m/s^2?",
        (0.5, 1000.0),
    ),
)
"""Checks of a bearing and of its load at rest."""
OF_RUN = (
    UsualRange(
        _limits("displacement", _of_capacity),
        (0.05, 1.5),
        "limits.displacement = {value:g} m is {measure:.3g} times the capacity of all surfaces, {of:.3g} m; is it in "
        "metres?",
        (0.001, 50.0),
    ),
    UsualRange(
        _limits("axial_load", _of_load),
        (0.9, 30.0),
        "limits.axial_load = {value:g} N is {measure:.3g} times the load at rest, {of:.4g} N; is it in N, not in kN?",
        (0.01, 1000.0),
    ),
    UsualRange(
        _limits("rim_force", _of_load),
        (0.03, 10.0),
        "limits.rim_force = {value:g} N is {measure:.3g} times the load at rest, {of:.4g} N; is it in N, not in kN?",
        (0.003, 300.0),
    ),
    UsualRange(
        _limits("rim_compression", _of_capacity),
        (-inf, 0.5),
        "limits.rim_compression = {value:g} m is {measure:.3g} times the capacity of all surfaces, {of:.3g} m; is it "
        "in metres?",
        (-inf, 1.0),
    ),
    UsualRange(
        _limits("uplift_height"),
        (-inf, 0.2),
        "limits.uplift_height = {value:g} m is more than bearings open before they come apart; is it in metres?",
        (-inf, 1.0),
    ),
    UsualRange(
        _rig,
        (10.0, inf),
        "top.stiffness = {value:g} N/m is {measure:.2g} times the stiffness of the bearing, {own:.3g} N/m, so that the "
        "rig moves instead; is it in N/m, not in kN/m?",
        (0.5, inf),
    ),
)
"""Checks of the limits of a bearing, and of a rig."""
LEAST_TARGETS = {"pga": 3.0, "sa": 3.0, "sds": 3.0, "ag": 1.0}  # EN 1998-1 maps a_g in m/s^2, often 1 to 3
BARE = "{path} = {value:g} m/s^2 is {in_g:.3g} g; give the unit, as in '{value:g} g', if it is meant in g"
OF_MOTION = (
    UsualRange(
        _peak,
        (0.02, 3.0),
        "motion: the peak acceleration of {value:.3g} m/s^2 is {measure:.3g} g; {remedy}",
        (1e-3, 100.0),
    ),
    UsualRange(
        _sampling,
        (2e-4, 0.1),
        "motion: the samples are {value:.3g} s apart; are the times of the record in s?",
        (3e-5, 2.0),
    ),
    UsualRange(
        _scale,
        (0.2, 3.0),
        "motion.scale = {value:.4g} changes the record by more than is usual (0.2 to 3); is the target of the scaling "
        "in m/s^2? '1.5 g' is a text with its unit",
        (-inf, 300.0),
    ),
    UsualRange(_bare_of_motion, (1.0, inf), BARE),
)
"""Checks of a motion: of accelerations that were sampled, and of the target of their scaling."""
OF_TARGET = (UsualRange(_bare, (1.0, inf), BARE),)
"""Checks of the target of a suite."""


def judged(checks: Sequence[UsualRange], subject: Any) -> Iterator[tuple[Doubt, bool]]:
    """The doubts about what is outside its usual range, and whether it is refused."""
    for check in checks:
        for reading in check.read(subject):
            number, value, measure, words = reading
            if not check.usual[0] <= measure <= check.usual[1]:
                text = check.text.format(index=number - 1, value=value, measure=measure, **words)
                yield (number, value, text), not check.refused[0] <= measure <= check.refused[1]


def doubtful_values(bearing: Bearing, load: float = 0.0, rims: bool = True) -> Iterator[Doubt]:
    """Values of a bearing that are unlikely. load: at rest [N]; 0: not known. rims: whether they are modelled."""
    yield from (doubt for doubt, _ in judged(OF_BEARING, Subject(bearing, load, rims)))


def _judged_scene(scene: SceneFields) -> Iterator[tuple[Doubt, bool]]:
    """What `judged` finds in a scene of one bearing."""
    rims = scene.effects.rims is not False
    subject = Subject(scene.bearing, load_at_rest(scene), rims, scene.limits, scene.top)
    yield from judged((*OF_BEARING, *OF_RUN), subject)
    yield from judged(OF_MOTION, scene.motion)


def scene_doubts(scene: SceneFields) -> Iterator[Doubt]:
    """Doubts about values of a scene, and about the springs that hold its top plate up."""
    yield from (doubt for doubt, _ in _judged_scene(scene))
    yield from unread_values(scene.bearing, scene.effects)
    if standing := standing_of(scene):
        yield from unsteady(*standing[:3])
    if (mass := sprung_mass(scene.top)) and isinstance(scene.top, MassTop):
        turn = np.sqrt((scene.top.vertical_stiffness or 0.0) / mass)
        damping = scene.top.vertical_damping
        ratio, cure = damping / (2 * turn * mass), 2 * USUAL_DAMPING * turn * mass
        if ratio < LEAST_DAMPING:
            name, what = "top.vertical_damping", "the mass vibrates on its vertical spring"
            yield 0, ratio, ringing(name, damping, what, turn, ratio, cure)


MOST_SHEAR = 1.0  # horizontal force over the load at rest above which one of the two is doubtful


def shear_doubts(force: float, load: float, name: str, of_load: str) -> Iterator[Doubt]:
    """The doubt about the largest horizontal force of a run [N]. load: at rest [N]. name, of_load: what both are."""
    if force > MOST_SHEAR * load > 0:
        text = (
            f"the {name} reaches {force:.4g} N, {force / load:.3g} times the {of_load} of {load:.4g} N: friction and "
            "the slope of dishes give no more than half of it; are loads in N and masses in kg, or does a rim carry it?"
        )
        yield 0, force, text


@singledispatch
def refusals(system: Any) -> list[str]:
    """The texts of the doubts about values that no unit can make right, each once."""
    return list(dict.fromkeys(system.refusals()))


@refusals.register(Scene)
def _refusals_of_bearing(system: Scene) -> list[str]:
    return [text for (_, _, text), refused in _judged_scene(system) if refused]


@singledispatch
def doubts(system: Any) -> list[str]:
    """The texts of the doubts about values of a system, each once, as in the notes of its run."""
    return list(dict.fromkeys(system.doubts()))


@doubts.register(Scene)
def _doubts_of_bearing(system: Scene) -> list[str]:
    """Those of the motion where the pendulum is equivalent to a stack, whose values are not given."""
    if system.fidelity == "equivalent":
        return motion_doubts(system.motion)
    return list(dict.fromkeys(text for _, _, text in scene_doubts(system)))


def motion_doubts(motion: Motion) -> list[str]:
    """The texts of the doubts about a motion."""
    return [text for (_, _, text), _ in judged(OF_MOTION, motion)]


def target_doubts(target: Mapping[str, Any] | None) -> list[str]:
    """The texts of the doubts about the target of a suite, a table of the fields of `ScaleTo`; none for None."""
    return [text for (_, _, text), _ in judged(OF_TARGET, target or {})]


def runs_of_doubts(runs: Iterable[tuple[str, Iterable[str]]]) -> dict[str, tuple[str, ...]]:
    """Text of a doubt -> the names of the runs that have it, each once. runs: names with the texts of each run."""
    found: dict[str, dict[str, None]] = {}
    for name, texts in runs:
        for text in texts:
            found.setdefault(text, {})[name] = None
    return {text: tuple(names) for text, names in found.items()}


NUMBER = re.compile(r"(?<![\[\d])[-+]?\d[\d.]*(e[-+]?\d+)?")  # but for the index of a surface
MOST_NAMES = 5  # of other runs in one line


def doubt_lines(runs: Sequence[tuple[str, Iterable[str]]]) -> list[str]:
    """One line for all doubts whose texts differ in numbers only: the first text, with the runs that have one.

    A text of all runs stands without names. runs: names with the texts of each run.
    """
    count = len({name for name, _ in runs})
    kinds: dict[str, list[tuple[str, tuple[str, ...]]]] = {}
    for text, names in runs_of_doubts(runs).items():
        kinds.setdefault(NUMBER.sub("", text), []).append((text, names))
    lines = []
    for alike in kinds.values():
        text, names = alike[0]
        if len(names) == count:
            lines.append(text)
            continue
        first, *others = dict.fromkeys(name for _, names in alike for name in names)
        more = f" and {len(others) - MOST_NAMES} more" if len(others) > MOST_NAMES else ""
        lines.append(f"{first}: {text}" + (f"; likewise {', '.join(others[:MOST_NAMES])}{more}" if others else ""))
    return lines


def require_meant(*systems: Any, force: bool = False) -> None:
    """Raise InputError for values of systems that no unit can make right, unless `force`.

    Commands, studies, bounds and fits call it. `simulate` does not: it takes a scene that a program has made, a limit
    case perhaps, and gives its result the note.
    """
    found = [] if force else list(dict.fromkeys(text for system in systems for text in refusals(system)))
    if found:
        raise InputError(f"{'; '.join(found)} (a command runs it with --force, a function of Python with force=True)")


def ringing(path: str, damping: float, what: str, turn: float, ratio: float, cure: float) -> str:
    """The text of a doubt about a vibration that rings on.

    path: of the damping in messages. damping: its value [N s/m]. what: the part that vibrates. turn: its circular
    frequency [rad/s]. ratio: its damping ratio [-]. cure: damping with which it has `USUAL_DAMPING` [N s/m].
    """
    return (
        f"{path} = {damping:g}: {what} at {turn / (2 * np.pi):.3g} Hz with {ratio:.1%} of critical damping and rings "
        f"on: accelerations and rotations depend on the tolerance by several per cent; give {cure:.3g} N s/m for "
        f"{USUAL_DAMPING:.0%}"
    )


def unread_values(bearing: Bearing, effects: Effects | Auto) -> Iterator[tuple[int, float, str]]:
    """Values of an effect that is off: number of the surface, the value, and the text of the doubt."""
    for effect, values in contract.SURFACE_OF_EFFECTS.items():
        if getattr(effects, effect) is not False:
            continue
        for number, surface in enumerate(bearing.surfaces, start=1):
            for name in contract.names(values):
                value = getattr(surface, name)
                if value is not None and value != getattr(type(surface), name):
                    text = (
                        f"bearing.surfaces[{number - 1}].{name} = {value:g}: effects.{effect} = false, so that nothing "
                        f"reads it; leave it out, or give {effect} = true"
                    )
                    yield number, value, text
