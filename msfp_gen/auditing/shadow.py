"""Shadow of a result: recorded motion and axial force drive the full model of the bearing, and the forces are compared.

What the element of the other program left out follows by taking effects out of the model one at a time: where the model
without an effect is nearer to the recorded force, the element does not have it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.auditing.checks import INCONSISTENT
from msfp_gen.auditing.columns import histories_from
from msfp_gen.auditing.corrections import corrected
from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.stated import Stated, stated_of
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.tables import Table
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load
from msfp_gen.results.result import Result
from msfp_gen.scene.fidelity import at_fidelity
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import Top
from msfp_gen.simulation.simulate import simulate
from msfp_gen.specification.friction_laws import BUILT_IN
from msfp_gen.specification.layout import Auto

OFF_CENTRE = 0.05  # permitted first displacement over the largest
LEAST_LOAD = 0.02  # axial force over that at rest that the model is given at least
HOLD = 5e3  # stiffness of the rig over the axial force at rest [1/m]: it moves some hundredths of a millimetre
TIGHTER = 0.1  # tolerance of the run that states the error, over that of the shadow
NEARER = 0.8  # difference without an effect over that with it, below which the element does not have the effect


@dataclass(frozen=True)
class LeftOut:
    """The model without one more effect.

    Attributes:
        effect: its name.
        before, after: RMS difference from the recorded force with it and without it, over the largest force [-]; None:
            the model cannot run without it.
        missing: whether the element does not have it: the model without it is nearer, by more than its error. The
            effects after it are then tried without it too.
        why: why the model cannot run without it; "" where it does.
    """

    effect: str
    before: float
    after: float | None
    missing: bool
    why: str = ""


@dataclass(frozen=True, eq=False)
class Shadow:
    """A recorded result beside the full model.

    Attributes:
        data: the recorded histories, with signs and units put right.
        stated: the data of the bearing.
        result: the run of the full model.
        error: of its force, RMS over the largest force: of the steps of the run and of the rows of the record [-].
        left_out: the effects of the model, tried one after the other.
        notes: what was changed in the record.
    """

    data: Histories
    stated: Stated
    result: Result
    error: float
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...] = ()

    @cached_property
    def force(self) -> Array:
        """Horizontal force of the model at the rows of the record, ndarray, shape (T, 2) [N]."""
        return _force(self.result, self.data)

    @property
    def difference(self) -> float:
        """RMS difference of the recorded force from that of the model, over the largest force [-]."""
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
            ("run of the model", self.result.status_text),
            *(("note", note) for note in self.notes),
        ]
        effects = [
            (one.effect, f"{100 * one.before:.3g} %", "-" if one.after is None else f"{100 * one.after:.3g} %", one.why)
            if not one.missing
            else (
                one.effect,
                f"{100 * one.before:.3g} %",
                f"{100 * (one.after or 0.0):.3g} %",
                "the element does not have it",
            )
            for one in self.left_out
        ]
        return [
            Table(f"shadow of {self.data.name} by {self.stated.name}", (), rows),
            Table(
                "RMS difference from the record with and without an effect", ("effect", "with", "without", ""), effects
            ),
            *self.result.part_tables(),
        ]

    @property
    def as_dict(self) -> dict[str, Any]:
        """As plain data: differences, effects, and the summary of the run of the model."""
        return {
            "name": self.data.name,
            "bearing": self.stated.name,
            "difference": self.difference,
            "error": self.error,
            "missing": list(self.missing),
            "left_out": {one.effect: [one.before, one.after] for one in self.left_out},
            "notes": list(self.notes),
            "model": self.result.summary,
        }


def shadow(source: Any, bearing: Any, columns: str | Path | Mapping[str, Any] | None = None) -> Shadow:
    """Drive the full model of a bearing by the recorded motion and axial force, and compare the forces.

    Args: as of `audit`.

    Raises InputError: as of `audit`, a column that is missing, or a record that does not begin at the centre. RunError:
    the model cannot follow the motion.
    """
    stated = stated_of(bearing)
    given = histories_from(source, columns)
    if missing := given.missing("displacement", "force", "axial"):
        raise InputError(f"{given.name}: no column {missing[0]}; a shadow needs displacement, force and axial")
    data, found = corrected(given, stated)
    start, most = (float(np.hypot(*rows)) for rows in (data.displacement[0], np.abs(data.displacement).max(axis=0)))
    if start > OFF_CENTRE * most:
        raise InputError(
            f"{given.name}: the first displacement is {1e3 * start:.4g} mm; cut the record to begin at the centre"
        )
    scene = shadow_scene(data, stated)
    result = simulate(scene)
    force = _force(result, data)
    finer = simulate(replace(scene, solver=replace(scene.solver, rtol=TIGHTER * scene.solver.rtol)))
    coarser = simulate(replace(scene, motion=_motion(data, 2), load=_load(data, 2)))
    largest = float(np.hypot(*data.force.T).max())
    others = [np.sqrt(np.mean(np.sum((_force(one, data) - force) ** 2, axis=1))) for one in (finer, coarser)]
    error = float(np.hypot(others[0], others[1] / 3.0)) / largest
    left_out = tuple(_left_out(scene, result, data, error))
    notes = [answer.sentence for answer in found.values() if answer.verdict == INCONSISTENT]
    low = data.axial < LEAST_LOAD * data.at_rest
    if low[data.moved_at() :].any():
        span = float((np.gradient(data.time) * low).sum())
        notes.append(f"the axial force is below {100 * LEAST_LOAD:g} % of that at rest for {span:.3g} s: it would open")
    return Shadow(data, stated, result, error, left_out, tuple(notes))


def shadow_scene(data: Histories, stated: Stated) -> Scene:
    """The bearing in a rig that holds its upper plate, moved as recorded, under the recorded axial force."""
    rest = data.at_rest
    top = Top.rig(rest, HOLD * rest, 1e-3 * HOLD * rest, HOLD * rest, 1e-3 * HOLD * rest)
    effects = Auto() if stated.scene is None else stated.scene.effects
    scene = Scene(
        stated.bearing,
        _motion(data),
        top,
        effects,
        load=_load(data),
        output_step=data.step,
        name=f"shadow of {data.name}",
    )
    return scene if stated.scene is None else replace(scene, solver=stated.scene.solver)


def _motion(data: Histories, step: int = 1) -> Motion:
    """The recorded displacement as motion of the base, from every so many rows."""
    u = data.displacement - data.displacement[0]
    return Motion.from_arrays(*_last_kept(data.time - data.time[0], np.column_stack([u, 0 * u[:, 0]]), step))


def _load(data: Histories, step: int = 1) -> Load:
    """The axial force beside that at rest."""
    rest = data.at_rest
    down = rest - np.maximum(data.axial, LEAST_LOAD * rest)
    return Load.from_arrays(*_last_kept(data.time - data.time[0], np.column_stack([0 * down, 0 * down, down]), step))


def _last_kept(time: Array, values: Array, step: int) -> tuple[Array, Array]:
    """Every so many rows, and the last one."""
    rows = np.unique(np.append(np.arange(0, len(time), step), len(time) - 1))
    return time[rows], values[rows]


def _force(result: Result, data: Histories) -> Array:
    """Force of a run at the rows of a record, (T, 2) [N]."""
    time = data.time - data.time[0]
    return np.column_stack([np.interp(time, result.history.time, result.history.top_force[:, i]) for i in (0, 1)])


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
        yield "varying axial force", lambda one: replace(one, load=None)
    if np.any(result.history.rim_force > 0):
        yield "rims", lambda one: one.with_effects(rims=False)
    if scene.bearing.layout.n > 3:
        yield "sliding regimes", lambda one: replace(at_fidelity(one, "equivalent"), duration=one.end)


def _left_out(scene: Scene, result: Result, data: Histories, error: float) -> Iterator[LeftOut]:
    """Effects taken out one after the other; those that the element does not have stay out."""
    before = _difference(_force(result, data), data)
    for name, without in _variants(scene, result, data):
        try:
            changed = without(scene)
            after = _difference(_force(simulate(changed), data), data)
        except (InputError, RunError) as failure:
            yield LeftOut(name, before, None, False, str(failure))
            continue
        missing = after < NEARER * before and after < before - error
        yield LeftOut(name, before, after, missing)
        if missing:
            scene, before = changed, after
