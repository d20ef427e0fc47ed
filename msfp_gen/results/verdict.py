"""The verdict of a run: what the device was asked to bear, against its limits (docs/results.md)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table
from msfp_gen.results.sliding import open_times
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.friction_parameters import start_temperatures
from msfp_gen.scene.scene_fields import Limits

if TYPE_CHECKING:
    from msfp_gen.results.result import Result

RIM_SHARE = 1 / 3  # rim force over the axial load, up to which the spring of a rim was compared
COMPRESSION_SHARE = 0.1  # compression of a rim over the capacity of its surface
ROUNDING = 1e-10  # of a value, relative
OF_WHOLE = ("axial_load", "displacement")  # limits of a whole bearing, not of its surfaces
NO_SURFACES = "the surfaces are not judged: the run has one pendulum in their place"
SCALES = {"N": (1e-3, "kN"), "m": (1e3, "mm")}  # unit -> factor and unit of texts


class ReachedValue(NamedTuple):
    """What was reached: surface from 1, 0: none; time [s], None: not known; the value and what is allowed, in the unit
    of the limit. All are of one instant.
    """

    surface: int
    time: float | None
    reached: float
    allowed: float


LimitReader = Callable[["Result", Limits], Iterable[ReachedValue]]


@dataclass(frozen=True)
class Limit:
    """One limit: key, name and unit of its quantity, and what reads it in a result."""

    key: str
    name: str
    unit: str
    read: LimitReader

    def shown(self, value: float) -> str:
        """A value with its unit."""
        factor, unit = SCALES.get(self.unit, (1.0, self.unit))
        return f"{value * factor:.4g} {unit}".rstrip()


@dataclass(frozen=True)
class LimitReading:
    """A limit, the bearing, and the value that it reached."""

    limit: Limit
    bearing: int
    label: str
    value: ReachedValue

    @property
    def exceeded(self) -> bool:
        """Whether the value is beyond the limit, by more than rounding."""
        return self.value.reached > self.value.allowed * (1 + ROUNDING)

    @property
    def share(self) -> float:
        """The value over its limit."""
        reached, allowed = self.value.reached, self.value.allowed
        return reached / allowed if allowed > 0 else math.inf if reached > 0 else 0.0

    @property
    def place(self) -> str:
        """Bearing and surface."""
        return ", ".join(filter(None, [self.label, f"surface {self.value.surface}" if self.value.surface else ""]))

    @property
    def as_dict(self) -> dict[str, Any]:
        """As plain data: limit, unit, bearing, surface, time [s], value and allowed in that unit."""
        surface, time, value, allowed = self.value
        about = {"limit": self.limit.key, "unit": self.limit.unit, "bearing": self.bearing, "surface": surface}
        return {**about, "time": time, "value": value, "allowed": allowed}


@dataclass(frozen=True)
class Verdict:
    """Values against limits, of one bearing or of all of a building.

    readings: of every limit that applies, bearing and surface. failure: how a run failed, else "". stopped: time at
    which it met its stop condition [s]; None: it did not. whole: whether the run has no surfaces of its bearing, so
    that limits of the whole bearing alone are judged.
    """

    readings: tuple[LimitReading, ...]
    failure: str = ""
    stopped: float | None = None
    whole: bool = False

    @property
    def ok(self) -> bool:
        """Whether the run reached its end and no limit was exceeded."""
        return self.word == "within"

    @cached_property
    def exceeded(self) -> tuple[LimitReading, ...]:
        """The readings beyond their limits."""
        return tuple(reading for reading in self.readings if reading.exceeded)

    @cached_property
    def worst(self) -> dict[str, LimitReading]:
        """Key of a limit -> the reading that is largest over what is allowed."""
        most: dict[str, LimitReading] = {}
        for reading in self.readings:
            key = reading.limit.key
            most[key] = max(most.get(key, reading), reading, key=lambda one: one.share)
        return most

    @property
    def word(self) -> str:
        """One of within, not judged, stopped, exceeded, failed; what comes after the stop condition is not known."""
        words = {
            "failed": self.failure,
            "exceeded": self.exceeded,
            "stopped": self.stopped is not None,
            "not judged": self.whole,
        }
        return next((word for word, holds in words.items() if holds), "within")

    @property
    def text(self) -> str:
        """One line: the limits that were exceeded, each with its worst value, place and time."""
        lines = self.exceeded_text
        if self.failure:
            return "the run failed" + (f"; until then exceeded: {lines}" if lines else "")
        if self.stopped is None:
            return f"exceeded: {lines}" if lines else self.unexceeded
        stop = f"the run met its stop condition at {self.stopped:.4g} s"
        return f"exceeded: {lines}; {stop}" if lines else f"{stop}; until then {self.unexceeded}"

    @property
    def unexceeded(self) -> str:
        """What holds where no limit was exceeded."""
        return NO_SURFACES if self.whole else "within the limits of the device"

    @property
    def exceeded_text(self) -> str:
        """The limits that were exceeded, "" where there is none."""
        return "; ".join(self._line(reading) for reading in self.worst.values() if reading.exceeded)

    def _line(self, reading: LimitReading) -> str:
        limit, (_, time, reached, allowed) = reading.limit, reading.value
        others = len({one.bearing for one in self.exceeded if one.limit.key == limit.key}) - 1
        more = f", and {others} other bearing{'s' * (others > 1)}" if others > 0 else ""
        where = ", ".join(filter(None, [reading.place, "" if time is None else f"{time:.4g} s"]))
        return f"{limit.name} {limit.shown(reached)}, limit {limit.shown(allowed)} ({where}{more})"

    @property
    def table(self) -> Table:
        """The worst value of every limit that applies."""
        rows = []
        for reading in self.worst.values():
            limit, (_, time, reached, allowed) = reading.limit, reading.value
            when = f"{time:.4g}" if reached and time is not None else "-"
            beyond = "EXCEEDED" if reading.exceeded else "within"
            place = (reading.place or "-") if reached else "-"
            rows.append((limit.name, limit.shown(reached), limit.shown(allowed), place, when, beyond))
        title = f"limits of the device: {self.word if self.failure else self._summary}"
        return Table(title, ("limit", "value", "allowed", "where", "time [s]", ""), rows)

    @property
    def _summary(self) -> str:
        if not self.exceeded:
            stop = "" if self.stopped is None else " until the stop condition"
            return NO_SURFACES if self.whole else f"within all{stop}"
        bearings = {reading.bearing for reading in self.exceeded} - {0}
        return f"exceeded{f' by {len(bearings)} bearing' + 's' * (len(bearings) > 1) if bearings else ''}"

    @property
    def as_dict(self) -> dict[str, Any]:
        """As plain data: word, text, limits (keys of those exceeded, in one text), exceeded and largest readings."""
        return {
            "word": self.word,
            "text": self.text,
            "limits": " ".join(dict.fromkeys(reading.limit.key for reading in self.exceeded)),
            "exceeded": [reading.as_dict for reading in self.exceeded],
            "largest": [reading.as_dict for reading in self.worst.values()],
        }


def verdict_of(
    bearings: Iterable[Result],
    limits: Limits | None,
    failure: str,
    stopped: float | None = None,
    whole: bool = False,
) -> Verdict:
    """The verdict of a run. limits: of the scene; None: the defaults. failure, stopped, whole: see `Verdict`."""
    allowed = limits or Limits()
    readings = [
        LimitReading(limit, one.number, one.label, value)
        for one in bearings
        for limit in LIMITS
        if limit.key in OF_WHOLE or not whole
        for value in limit.read(one, allowed)
    ]
    return Verdict(tuple(readings), failure, stopped, whole)


def _by_surface(one: Result, name: str, reached: Array, allowed: Array | float) -> Iterator[ReachedValue]:
    """Values of every surface, reached when the extreme `name` was."""
    for j, (value, most) in enumerate(zip(reached, np.broadcast_to(allowed, reached.shape), strict=True)):
        yield ReachedValue(j + 1, float(one.extremes.times[name][j]), float(value), float(most))


def _rim_force(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    load = float(one.extremes.most_normal.max()) if one.axial_load is None else one.axial_load
    yield from _by_surface(one, "rim_force", np.asarray(one.extremes.rim_force), limits.rim_force or RIM_SHARE * load)


def _rim_compression(one: Result, limits: Limits) -> Iterable[ReachedValue]:
    if not _rims_are_modelled(one):
        return ()  # `beyond_rim` says so
    allowed = limits.rim_compression or COMPRESSION_SHARE * one.bearing.arrays()["capacity"]
    return _by_surface(one, "gap", np.maximum(0.0, -one.extremes.gap), allowed)


def _rims_are_modelled(one: Result) -> bool:
    """Whether rims carry force wherever a slider went beyond its capacity."""
    return not any(note.kind == "rims" and not note.action for note in one.notes)


def _travel(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    """Rims in contact at one time; one surface must be left to slide."""
    # By the contacts that the run has located; a building counts them over all steps.
    allowed = float(len(one.extremes.gap) - 1)
    if one.extremes.rims_met is not None:
        yield ReachedValue(0, float(one.extremes.times["rims_met"][0]), float(one.extremes.rims_met[0]), allowed)
        return
    closed = (one.history.gap <= 0) | (one.history.rim_force > 0)
    counts = closed.sum(axis=1)
    row = int(counts.argmax())
    most, time = int(counts[row]), float(one.history.time[row])
    met = {int(surface) + 1 for surface in np.flatnonzero(closed[0])}
    for event in one.events:
        if event.kind == "rim_contact":
            met.add(event.surface)
        elif event.kind == "rim_release":
            met.discard(event.surface)
        if len(met) > most or (len(met) == most and event.time < time):
            most, time = len(met), event.time
    yield ReachedValue(0, time, float(most), allowed)


def _uplift_height(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    bearing = one.bearing
    offsets = bearing.arrays()["rim_offset"][[bearing.slider(j) for j in range(len(bearing.surfaces))]]
    allowed = np.full(len(offsets), limits.uplift_height) if limits.uplift_height else offsets
    for value in _by_surface(one, "lift", np.asarray(one.extremes.lift), allowed):
        if value.allowed > 0:  # without a rim_offset no height is known
            yield value


def _uplift_duration(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    for surface, spells in enumerate(open_times(one.history, one.events), start=1):
        start, length = max(spells, key=lambda spell: spell[1], default=(0.0, 0.0))
        yield ReachedValue(surface, start, length, limits.uplift_duration)


def _temperature(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    """Temperatures of the friction law, or of the monitor of heat where the law has none."""
    if one.extremes.temperature is not None:
        yield from _by_surface(one, "temperature", one.extremes.temperature, limits.temperature)
    for note in one.notes:
        if note.kind == "heat" and not note.action:
            start = float(start_temperatures(one.bearing)[note.surface - 1])
            yield ReachedValue(note.surface, note.value_time, start + note.value, limits.temperature)


def _of_bearing(one: Result, limits: Limits, name: str) -> Iterator[ReachedValue]:
    """The axial load or the displacement of a whole bearing, where a limit is given."""
    extreme, component = {"axial_load": ("top_force", 2), "displacement": ("displacement", 3)}[name]
    if (allowed := getattr(limits, name)) is not None:
        values, times = getattr(one.extremes, extreme), one.extremes.times[extreme]
        yield ReachedValue(0, float(times[component]), float(values[component]), allowed)


def _beyond_rim(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    """The largest sliding beyond a capacity that the monitor of rims noted."""
    for note in one.notes:
        if note.kind == "rims" and not note.action:
            yield ReachedValue(note.surface, note.value_time, note.value, 0.0)


def _radius(bearing: Bearing, surface: int) -> float:
    """Radius of the face of a slider [m]; surface from 1."""
    return float(bearing.arrays()["rim_radius"][bearing.slider(surface - 1)])


def _face(one: Result, limits: Limits) -> Iterator[ReachedValue]:
    """Distances as a bearing of a building records them, or as the note of a bearing alone states them."""
    offsets = one.extremes.contact_offset
    if offsets is None:
        for note in one.notes:
            if note.kind == "footprint" and not note.action:
                yield ReachedValue(note.surface, note.value_time, note.value, _radius(one.bearing, note.surface))
        return
    times = one.extremes.times["contact_offset"].tolist()
    for surface, (offset, time) in enumerate(zip(offsets.tolist(), times, strict=True), start=1):
        if (radius := _radius(one.bearing, surface)) > 0:  # else no face is known
            yield ReachedValue(surface, time, offset, radius)


LIMITS = (
    Limit("rim_force", "rim force", "N", _rim_force),
    Limit("rim_compression", "rim compression", "m", _rim_compression),
    Limit("travel", "rims met at one time", "", _travel),
    Limit("beyond_rim", "sliding beyond a rim that the model leaves out", "m", _beyond_rim),
    Limit("uplift_height", "opening of a surface", "m", _uplift_height),
    Limit("uplift_duration", "time for which a surface is open", "s", _uplift_duration),
    Limit("face", "contact off the axis of the slider", "m", _face),
    Limit("temperature", "temperature", "degC", _temperature),
    Limit("axial_load", "axial load", "N", partial(_of_bearing, name="axial_load")),
    Limit("displacement", "displacement", "m", partial(_of_bearing, name="displacement")),
)
"""All limits in the order of tables; those that `Limits` has as fields can be given."""
