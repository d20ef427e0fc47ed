"""Shadow of a result: recorded motion and axial force drive the full model of the bearing, and both are compared.

What the element of the other program left out follows by taking effects out of the model one at a time: where the model
without an effect is nearer to the recorded force, the element does not have it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from msfp_gen.auditing.case import INCONSISTENT
from msfp_gen.auditing.columns import histories_from
from msfp_gen.auditing.corrections import corrected
from msfp_gen.auditing.driving import LEAST_LOAD, even_load, force_of, off_centre, opening_scene, opens, shadow_scene
from msfp_gen.auditing.histories import QUANTITIES, Histories
from msfp_gen.auditing.mechanics import holds_down
from msfp_gen.auditing.stated import Stated, stated_of
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.tables import Table
from msfp_gen.results.result import Result
from msfp_gen.results.sliding import merged, open_times
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.scene import Scene
from msfp_gen.simulation.simulate import simulate
from msfp_gen.specification.friction_laws import BUILT_IN

SURFACES = ("sliding", "slip_speed", "temperature")  # columns with the number of a surface
BOUNCES = 0.05  # closed for less, surfaces bounce [s]
TIGHTER = 0.1  # tolerance of the run that states the error, over the shadow's
NEARER = 0.8  # difference without an effect over the one with it, below which the element does not have it


@dataclass(frozen=True)
class LeftOut:
    """What the model without one more effect shows.

    Attributes:
        effect: its name.
        before, after: RMS difference from the recorded force with it and without it, over the largest force [-]; None:
            no run decides it.
        missing: whether the element does not have it: the model without it is nearer, by more than its error. The
            effects after it are then tried without it too. Lift-off is missing where the record has tension.
        why: why the model cannot run without it, or what decides; "" where a run does.
    """

    effect: str
    before: float
    after: float | None
    missing: bool
    why: str = ""


class Difference(NamedTuple):
    """A recorded history against the computed one.

    quantity: name of the column without its number. surface: 1 at the bottom; 0: of the whole bearing. rms, largest:
    [unit]. size: largest recorded value, of temperatures their rise [unit]. time: of the largest difference [s].
    """

    quantity: str
    surface: int
    rms: float
    largest: float
    size: float
    unit: str
    time: float

    @property
    def title(self) -> str:
        """Quantity and surface in words."""
        return self.quantity.replace("_", " ") + (f", surface {self.surface}" if self.surface else "")


@dataclass(frozen=True, eq=False)
class Shadow:
    """A recorded result beside the full model.

    Attributes:
        data: the recorded histories, with signs and units put right.
        stated: the data of the bearing.
        result: the run of the full model, which carries a fiftieth of the axial force at rest at least.
        opened: the run in which surfaces separate, and the upper plate has the mass that gives the axial force at rest;
            None where the recorded axial force is always compression.
        error: of the force of the run, RMS over the largest force, by its steps and by the rows of the record [-].
        left_out: the effects of the model, tried one after the other.
        notes: what was changed in the record.
    """

    data: Histories
    stated: Stated
    result: Result
    opened: Result | None
    error: float
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...] = ()

    @cached_property
    def force(self) -> Array:
        """Horizontal force of the model at the rows of the record, ndarray, shape (T, 2) [N]."""
        return force_of(self.result, self.data)

    @cached_property
    def histories(self) -> dict[tuple[str, int], tuple[Array, Array]]:
        """Histories that both have: (quantity, surface) -> recorded and of the model, (T,) or (T, 2) each [SI]."""
        rows, columns, time = self.result.alone.history, self.data.columns, self.data.time - self.data.time[0]
        own = {
            "sliding": rows.sliding,
            "slip_speed": np.linalg.norm(rows.slip_velocity, axis=2),
            "temperature": rows.temperature,
        }
        found = {("force", 0): (self.data.force, self.force)}
        for name, values in own.items():
            for surface in range(1, 0 if values is None else values.shape[1] + 1):
                if (column := columns.get(f"{name}_{surface}")) is not None:
                    found[name, surface] = (column, np.interp(time, rows.time, values[:, surface - 1]))
        return found

    @cached_property
    def differences(self) -> tuple[Difference, ...]:
        """The recorded histories against the computed ones: the force, and the histories of the surfaces."""
        return tuple(self._difference(*key, *pair) for key, pair in self.histories.items())

    def _difference(self, quantity: str, surface: int, recorded: Array, own: Array) -> Difference:
        start = recorded[0] if quantity == "temperature" else 0.0
        apart, size = (np.linalg.norm(np.reshape(v, (len(v), -1)), axis=1) for v in (recorded - own, recorded - start))
        row = int(apart.argmax())
        unit = QUANTITIES[f"{quantity}_1"][0].replace("degC", "K")
        rms = float(np.sqrt(np.mean(apart**2)))
        return Difference(
            quantity, surface, rms, float(apart[row]), float(size.max()), unit, float(self.data.time[row])
        )

    @cached_property
    def openings(self) -> list[tuple[float, float]]:
        """Times in which any surface is open in the model, as (start, length) [s]; openings of one lift-off bounce."""
        if self.opened is None:
            return []
        found = open_times(self.opened.alone.history, self.opened.events)
        spells = merged(spell for surface in found for spell in surface)
        return [(float(self.data.time[0] + start), float(length)) for start, length in spells]

    @property
    def lift_off(self) -> str:
        """When, how long and how far surfaces separate in the model; "" where the axial force is always compression."""
        if self.opened is None:
            return ""
        low = opens(self.data)
        span = float((np.gradient(self.data.time) * low).sum())
        least = f"{self.data.axial[low].min() / 1e3:.4g} kN"
        first = (
            f"the recorded axial force is down to {least}, and below {LEAST_LOAD:.0%} of that at rest for {span:.3g} s"
        )
        if not self.openings:
            return f"{first}; no surface parts in the model"
        whole, longest = sum(length for _, length in self.openings), max(self.openings, key=lambda spell: spell[1])
        times = len(merged((start, length + BOUNCES) for start, length in self.openings))
        return (
            f"{first}; surfaces part {times} time{'s' * (times > 1)}, first at {self.openings[0][0]:.4g} s, open "
            f"for {whole:.3g} s in all, longest for {longest[1]:.3g} s at {longest[0]:.4g} s, by up to "
            f"{1e3 * float(self.opened.history.lift.max()):.3g} mm"
        )

    @property
    def difference(self) -> float:
        """RMS difference between the recorded and the computed force, over the largest force [-]."""
        return _difference(self.force, self.data)

    @property
    def missing(self) -> tuple[str, ...]:
        """Effects that the element does not have: without them the model is nearer, by more than its error."""
        return tuple(one.effect for one in self.left_out if one.missing)

    @property
    def text(self) -> str:
        """One line: the difference with its error, and which effects the element does not have."""
        shares = f"forces differ by {100 * self.difference:.2g} % RMS of the largest, +- {100 * self.error:.1g} %"
        if self.missing:
            return f"{shares}; the element does not have: {', '.join(self.missing)}"
        return f"{shares}; no effect was found left out"

    @property
    def tables(self) -> list[Table]:
        """Differences, effects and what every surface did."""
        apart = np.hypot(*(self.force - self.data.force).T)
        row = int(apart.argmax())
        largest = float(np.hypot(*self.data.force.T).max())
        place = f"{apart[row] / 1e3:.4g} kN, {100 * apart[row] / largest:.3g} % of the largest force"
        rows = [
            ("forces", self.text),
            ("largest difference", f"{place}, at {self.data.time[row]:.4g} s"),
            *([("lift-off", self.lift_off)] if self.lift_off else []),
            ("run of the model", self.result.status_text),
            *(("note", note) for note in self.notes),
        ]
        effects = [
            (
                one.effect,
                f"{100 * one.before:.3g} %",
                "-" if one.after is None else f"{100 * one.after:.3g} %",
                "; ".join(filter(None, ["the element does not have it" if one.missing else "", one.why])),
            )
            for one in self.left_out
        ]
        return [
            Table(f"shadow of {self.data.name} by {self.stated.name}", (), rows),
            Table(
                "RMS difference from the record with and without an effect", ("effect", "with", "without", ""), effects
            ),
            Table(
                "differences from the model",
                ("history", "RMS", "largest", "of", "at [s]"),
                [
                    (
                        one.title,
                        f"{one.rms:.3g} {one.unit}",
                        f"{one.largest:.3g} {one.unit}",
                        f"{one.size:.3g} {one.unit}",
                        f"{one.time:.4g}",
                    )
                    for one in self.differences
                ],
            ),
            *self.result.part_tables(),
        ]

    @property
    def as_dict(self) -> dict[str, Any]:
        """The comparison as plain data: differences, effects, and the summary of the run of the model."""
        return {
            "name": self.data.name,
            "bearing": self.stated.name,
            "difference": self.difference,
            "error": self.error,
            "missing": list(self.missing),
            "left_out": {one.effect: [one.before, one.after] for one in self.left_out},
            "differences": [one._asdict() for one in self.differences],
            "lift_off": self.lift_off,
            "openings": self.openings,
            "notes": list(self.notes),
            "model": self.result.summary,
        }

    def page(self, path: str | Path) -> Path:
        """Write an HTML page with the evidence drawn. Raises InputError for a path that cannot be written."""
        from msfp_gen.auditing.page import shadow_opinion, write_opinion

        return write_opinion(shadow_opinion(self), path)


def shadow(source: Any, bearing: Any, columns: str | Path | Mapping[str, Any] | None = None) -> Shadow:
    """Drive the full model of a bearing by the recorded motion and axial force, and compare its force and surfaces.

    Both plates move as recorded where there are columns of them, else the ends move by the displacement across the
    bearing. Where the axial force is nearly zero or tension, surfaces separate.

    Args: see `audit`.

    Raises InputError: see `audit`, a column that is missing, or a record that does not begin at the centre. RunError:
    the model cannot follow the motion.
    """
    stated = stated_of(bearing)
    given = histories_from(source, columns)
    if missing := given.missing("displacement", "force", "axial"):
        raise InputError(f"{given.name}: no column {missing[0]}; a shadow needs displacement, force and axial")
    data, found = corrected(given, stated)
    if "axial" not in data.columns:
        raise InputError(f"{given.name}: {found['signs'].sentence.split(': ')[0]}; a shadow needs the load at rest")
    if not data.force.any():
        raise InputError(f"{given.name}: the force is zero in every row; a shadow compares it with the model's")
    if start := off_centre(data):
        raise InputError(
            f"{given.name}: the first displacement is {1e3 * start:.4g} mm; cut the record to begin at the centre"
        )
    beyond = [
        name for name in data.columns if name.startswith(SURFACES) and int(name[-1]) > stated.bearing.layout.surfaces
    ]
    if beyond:
        raise InputError(f"{given.name}: {beyond[0]}: the bearing has {stated.bearing.layout.surfaces} surfaces")
    scene = shadow_scene(data, stated)
    result = simulate(scene)
    force = force_of(result, data)
    finer = simulate(replace(scene, solver=replace(scene.solver, rtol=TIGHTER * scene.solver.rtol)))
    coarser = simulate(shadow_scene(data, stated, 2))
    opened = simulate(opening_scene(data, scene, result)) if opens(data).any() else None
    largest = float(np.hypot(*data.force.T).max())
    others = [np.sqrt(np.mean(np.sum((force_of(one, data) - force) ** 2, axis=1))) for one in (finer, coarser)]
    error = float(np.hypot(others[0], others[1] / 3.0)) / largest
    left_out = tuple(_left_out(scene, stated, result, data, error))
    notes = [answer.sentence for answer in found.values() if answer.verdict == INCONSISTENT]
    return Shadow(data, stated, result, opened, error, left_out, tuple(notes))


def _difference(force: Array, data: Histories) -> float:
    apart = np.sum((force - data.force) ** 2, axis=1)
    return float(np.sqrt(apart.mean()) / np.hypot(*data.force.T).max())


def _variants(scene: Scene, result: Result, data: Histories) -> Iterator[tuple[str, Callable[[Scene], Scene]]]:
    """Name of an effect, and a function that takes it out of a scene."""
    word = scene.with_all_effects().modelled.friction if result.model_changes else result.effects.friction
    if word == "pvtd":
        yield "thickness of the heated plates", lambda one: one.with_effects(friction="pvt")
    if word in ("pvt", "pvtd"):
        yield "heat", lambda one: one.with_effects(friction="pv")
    if word in BUILT_IN:
        yield "friction by velocity and pressure", lambda one: one.with_effects(friction="constant")
    if np.std(data.axial) > 1e-3 * data.at_rest:
        yield "varying axial force", lambda one: even_load(data, one)
    if np.any(result.history.rim_force > 0):
        yield "rims", lambda one: one.with_effects(rims=False)
    if scene.bearing.layout.n > 3:
        yield "sliding regimes", lambda one: replace(at_fidelity(one, "equivalent"), duration=one.end)


def _left_out(scene: Scene, stated: Stated, result: Result, data: Histories, error: float) -> Iterator[LeftOut]:
    """Effects taken out one after the other; those that the element does not have stay out."""
    before = _difference(force_of(result, data), data)
    if holds_down(data, stated):
        yield LeftOut("lift-off", before, None, True, "its axial force is a tension")
    for name, without in _variants(scene, result, data):
        try:
            changed = without(scene)
            after = _difference(force_of(simulate(changed), data), data)
        except (InputError, RunError) as failure:
            yield LeftOut(name, before, None, False, str(failure))
            continue
        missing = after < NEARER * before and after < before - error
        yield LeftOut(name, before, after, missing)
        if missing:
            scene, before = changed, after
