"""Which effect decides: each effect of a system changed alone, with what that does to quantities, cost and verdict."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Any

import numpy as np

from msfp_gen.common.aliases import Say
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.fields import Choice, ruled_fields
from msfp_gen.common.tables import Table
from msfp_gen.results.quantities import quantities
from msfp_gen.results.verdict import LimitReading
from msfp_gen.scene.scene import effects_named
from msfp_gen.scene.system import System
from msfp_gen.simulation.simulate import simulate
from msfp_gen.specification.formula import names_in
from msfp_gen.specification.friction_laws import BUILT_IN, VARIABLES, Law, law_of
from msfp_gen.specification.layout import OF_THE_SCENE, Effects
from msfp_gen.studies.accuracy.error_target import ringing

TOLERANCE = "tolerance"  # in place of an effect, in the row of the numerical error
TIGHTER = 0.1  # tolerance of the run that measures the numerical error, over the scene's tolerance
REPEATS, LONG_ENOUGH = 3, 0.3  # runs, and the fastest is timed; one run alone if it takes so long [s]


@dataclass(frozen=True)
class EffectRun:
    """One run.

    values: of every quantity, an array of shape (m,) over m surfaces or floors in its SI unit, such as [m]; NaN where
    it has no value. limits: the worst reading of each, by its name. seconds: of the fastest run.
    """

    values: Mapping[str, Array]
    limits: Mapping[str, LimitReading]
    seconds: float


@dataclass(frozen=True)
class EffectChange:
    """One effect changed alone, all else as the system has it.

    Attributes:
        effect: field of `Effects`; "tolerance" for the run with the tighter tolerance.
        before, after: its value at the end of the run of the system, and the one tried.
        changes: quantity -> its change, relative to the value of the system; the largest over surfaces or floors [-].
        cost: seconds of the run over the seconds of the system [-]; None where it could not run.
        limits: limit -> "within", "exceeded" or "undecided", where it is not what it is for the system.
        why: why it cannot run, in one line; "" where it did.
    """

    effect: str
    before: str
    after: str
    changes: Mapping[str, float]
    cost: float | None
    limits: Mapping[str, str]
    why: str = ""

    @property
    def decides(self) -> str:
        """What becomes of the verdict."""
        return ", ".join(f"{name} {state}" for name, state in self.limits.items()) or "same"


@dataclass(frozen=True)
class EffectStudy:
    """Every effect of a system changed alone. error: the numerical error of each quantity, as `EffectChange.changes`.

    undecided: limits that lie within the numerical error of what the system reaches. rings: whether nothing damps the
    ringing of stuck sliders, of which `error` may have too little.
    """

    name: str
    changes: tuple[EffectChange, ...]
    error: Mapping[str, float]
    undecided: tuple[str, ...]
    rings: bool = False

    @property
    def tables(self) -> list[Table]:
        """The changes as text, and the reasons of those that could not run."""
        names = list(self.error)
        head = ("effect", "from", "to", *(name.replace("_", " ") for name in names), "time", "verdict")
        rows = [
            (one.effect, one.before, one.after, *(self._shown(one, name) for name in names), _times(one.cost),
             "-" if one.why else one.decides)
            for one in self.changes
        ]  # fmt: skip
        about = [("tolerance", "the first row is the numerical error; changes that are smaller are shown as 0")]
        if self.rings:
            rings = "nothing damps the ringing of stuck sliders, which both runs of the first row may filter"
            about.append(("ringing", f"{rings}: give contact_damping, or take the error of run --error"))
        about += [("undecided", f"{name}: the limit lies within the numerical error") for name in self.undecided]
        about += [(f"{one.effect} = {one.after}", one.why) for one in self.changes if one.why]
        return [
            Table(f"effects of {self.name or 'the scene'}, each changed alone", head, rows),
            Table("notes", (), about),
        ]

    def _shown(self, one: EffectChange, name: str) -> str:
        """The change of a quantity, in per cent; 0 within the numerical error."""
        value, error = one.changes.get(name), abs(self.error[name])
        if value is None or not isfinite(value):
            return "-"
        if one.effect == TOLERANCE:
            return f"±{100 * error:.2g} %"
        return "0" if abs(value) <= error else f"{100 * value:+.2g} %"


def effect_by_effect(system: System, say: Say = lambda _: None, only: Collection[str] = ()) -> EffectStudy:
    """Run a system, then once more for every other value of each of its effects.

    Limits within the numerical error of a value, which a run at a tenth of the tolerance measures, are undecided.

    Args:
        system: a scene of a bearing, a building, or any other system that has effects.
        say: called with a line before each run.
        only: fields of `Effects` that are changed; empty: all.

    Raises:
        InputError: the system has no effects that can be changed.
        RunError: the run of the system itself fails.
    """
    if not system.every_effects:
        raise InputError(f"{system.name}: this system has no effects that can be changed")
    say("as it stands")
    base, ended = _run(system)
    say(f"tolerance {TIGHTER * system.solver.rtol:g}")
    tight, _ = _run(replace(system, solver=replace(system.solver, rtol=TIGHTER * system.solver.rtol)))
    both = base.limits.keys() & tight.limits.keys()
    noise = {key: abs(base.limits[key].value.reached - tight.limits[key].value.reached) for key in both}
    states = _states(base, noise)
    found = [_change(TOLERANCE, f"{system.solver.rtol:g}", f"{TIGHTER * system.solver.rtol:g}", base, tight, {}, {})]
    for effect, before, after, changes in _alternatives(system.every_effects, ended):
        if only and effect not in only:
            continue
        say(f"{effect} = {after}")
        try:
            other, _ = _run(system.with_effects(**changes))
        except (InputError, RunError) as error:
            found.append(EffectChange(effect, before, after, {}, None, {}, str(error).partition("\n")[0]))
        else:
            found.append(_change(effect, before, after, base, other, states, _states(other, noise)))
    undecided = tuple(key for key, state in states.items() if state == "undecided")
    return EffectStudy(system.name, tuple(found), found[0].changes, undecided, ringing(system)[1])


def _run(system: System) -> tuple[EffectRun, dict[str, Any]]:
    """The outcome of a system, and the effects that its run took in on the way: field -> value."""
    result = simulate(system)
    seconds = [float(result.summary["wall_time"])]
    while len(seconds) < REPEATS and seconds[0] < LONG_ENOUGH:
        seconds.append(float(simulate(system).summary["wall_time"]))
    columns: dict[str, list[float]] = {}
    for column, source in quantities(system).items():
        if source.quantity.kept and source.quantity.side:
            name = column if source.place is None else column.rpartition("_")[0]
            value = source.value(result.entry, None)
            columns.setdefault(name, []).append(nan if value is None else float(value))
    values = {name: np.array(each) for name, each in columns.items() if np.isfinite(each).any()}
    ended = effects_named([result.provenance.get("model", "")])
    limits = {one.limit.name: one for one in result.verdict.worst.values()}
    return EffectRun(values, limits, min(seconds)), ended


def _states(outcome: EffectRun, noise: Mapping[str, float]) -> dict[str, str]:
    """Limit -> within or exceeded, as the verdict has it, or undecided where it lies within the numerical error."""
    states = {}
    for name, one in outcome.limits.items():
        near = abs(one.value.reached - one.value.allowed) < noise.get(name, 0.0)
        states[name] = "undecided" if near else "exceeded" if one.exceeded else "within"
    return states


def _change(
    effect: str, before: str, after: str, base: EffectRun, other: EffectRun,
    states: Mapping[str, str], others: Mapping[str, str],
) -> EffectChange:  # fmt: skip
    """How another outcome differs from the system's."""
    limits = {name: state for name, state in others.items() if states.get(name, state) != state}
    changes = {}
    for name, values in base.values.items():
        found = other.values.get(name, np.full_like(values, nan))
        moved = np.where(np.isnan(values) & np.isnan(found), 0.0, found - values)
        changes[name] = float(moved[np.abs(moved).argmax()] / np.nanmax(np.abs(values))) if moved.any() else 0.0
    cost = other.seconds / base.seconds if base.seconds else None
    return EffectChange(effect, before, after, changes, cost, limits)


def _alternatives(
    every: tuple[Effects, ...], ended: Mapping[str, Any]
) -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Effect, its value, another value, both in words, and the fields that give it; values are of the first bearing."""
    has = {**vars(every[0]), **ended}
    simpler = simpler_laws(law_of(has["friction"], has["friction_law"]))
    for name, rule, _ in ruled_fields(Effects):
        if name in OF_THE_SCENE or not isinstance(rule, Choice) or (name == "spin" and has["dimension"] == "planar"):
            continue
        others = simpler if name == "friction" else rule.words
        more = {"friction_law": None} if name == "friction" else {}
        for other in others:
            if other != has[name]:
                yield name, _word(has[name]), _word(other), {name: other, **more}


def simpler_laws(law: Law | None) -> list[str]:
    """Friction laws that depend on less than a law and need no other number, then constant friction."""
    if law is None:
        return []
    known, variables = {*law.parameters, *law.also_accepted}, names_in(law.tree) & VARIABLES.keys()
    simpler = [
        other.word
        for other in BUILT_IN.values()
        if known.issuperset(other.parameters) and names_in(other.tree) & VARIABLES.keys() < variables
    ]
    return [*simpler, "constant"]


def _word(value: object) -> str:
    return {True: "on", False: "off"}.get(value, str(value)) if isinstance(value, bool) else str(value)


def _times(cost: float | None) -> str:
    return "-" if cost is None else f"{cost:.2g}x"
