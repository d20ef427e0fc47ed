"""`Member`: a bearing in the run of a building, its monitors, and its change to another model where one asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from msfp_gen.common.arrays import Array, parts
from msfp_gen.coupling.two_port import compiled_port, scene_at_rest
from msfp_gen.errors import InputError
from msfp_gen.model.model import Model, build_model
from msfp_gen.results.note import Note
from msfp_gen.results.restart_state import RestartState, transferred_heights, transferred_state
from msfp_gen.scene.effect_switching import Ending, monitor_options, stopping_monitors
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.buildings.scene import BuildingScene
    from msfp_gen.model.compiled import Port
    from msfp_gen.scene.scene import Scene
    from msfp_gen.scene.solver import Solver


@dataclass(frozen=True, eq=False)
class Change:
    """A bearing that continues with another model.

    bearing: from 0. effects: those that changed. rows: how many the run had. work: integrals of the powers of the
    bearing until then [J]. build: of the new model. notes: of the monitors of the earlier one.
    """

    bearing: int
    effects: dict[str, Any]
    rows: int
    work: list[float]
    build: str
    notes: tuple[Note, ...]

    @property
    def table(self) -> dict[str, Any]:
        """As plain data."""
        return {**vars(self), "notes": [vars(note) for note in self.notes]}

    @classmethod
    def of_table(cls, table: dict[str, Any]) -> Change:
        """The inverse of `table`."""
        return cls(**{**table, "notes": tuple(Note(**each) for each in table["notes"])})


def earlier_work(changes: Sequence[Change], bearing: int, shape: tuple[int, ...]) -> Array:
    """Integrals of the powers of a bearing before its model of a row began, shape (rows, integrals) [J]."""
    found = np.zeros(shape)
    for change in changes:
        if change.bearing == bearing:
            found[change.rows :] = change.work
    return found


OF_SURFACES = ("normal", "sliding", "rim", "compression")  # of the row of a bearing; the last only with uplift
KEPT = (*OF_SURFACES, "kinetic", "potential", "rim_stored", "seat_stored", "work")


class Asked(NamedTuple):
    """What is asked of a bearing: see `effect_switching.Requested`."""

    effects: Effects | Auto
    solver: Solver
    end: float


@dataclass(frozen=True, eq=False)
class Member:
    """A bearing in a run.

    asked: of its effects. effects: of its model. rest: the scene of the bearing at rest between its ends. port: that
    the run steps.
    """

    asked: Asked
    effects: Effects
    rest: Scene
    model: Model
    port: Port

    @classmethod
    def of(cls, scene: BuildingScene, index: int, effects: Effects) -> Self:
        """A bearing of a building at rest, from 0, with a model of these effects. Raises InputError."""
        given, load, solver = scene.bearings[index], float(scene.axial_loads[index]), scene.solver
        asked = Asked(Auto() if given.effects is None else given.effects, solver, scene.end)
        try:
            rest = scene_at_rest(given.bearing, given.interface, load, effects, solver)
        except InputError as error:
            raise InputError(f"scene.bearings[{index}]: {error}") from None
        model = build_model(given.bearing.layout, rest.modelled)
        stops = stopping_monitors(asked, effects, strict=False)
        options = monitor_options(rest, effects, scene.effect_selections[index], stops, noted=("uplift",))
        return cls(asked, effects, rest, model, compiled_port(rest, model, load, **options))

    @property
    def shapes(self) -> list[tuple[str, tuple[int, ...]]]:
        """The parts of its row that a run keeps: names and shapes, in order, the same for every model of a layout."""
        shapes = dict.fromkeys(OF_SURFACES, (self.rest.bearing.layout.surfaces,))
        shapes |= {name: tuple(shape) for name, shape in self.model.extension.ROW}
        return [(name, shapes[name]) for name in KEPT]

    @property
    def entries(self) -> Array:
        """Indices into the row of its model of the numbers that are kept; -1 where it has none, which counts as 0."""
        row = [(name, tuple(shape)) for name, shape in self.model.extension.ROW]
        size = sum(int(np.prod(shape, dtype=int)) for _, shape in row)
        indices = parts(np.arange(size), row)
        kept = [indices[name] if name in indices else np.full(shape, -1) for name, shape in self.shapes]
        return np.concatenate([values.ravel() for values in kept])

    @property
    def work(self) -> Array:
        """Integrals of its powers since its model began, at the committed state [J]."""
        found: Array = self.model.unpack(self.port.row)["work"]
        return found

    def ending(self, status: str, surface: int = 0, value: float = 0.0) -> Ending:
        """How it ended with its model."""
        return Ending(self.effects, status, self.port.time, surface, value, self.port.trips)

    def continue_from(self, other: Member, ends: Array) -> None:
        """Enter the state of another model of the same bearing; ends: their motion in it, shape (2, 3, 6)."""
        at = RestartState.of_port(other.port)
        parts = (self.rest.bearing, self.rest.top, self.model, at)
        q, v, f = transferred_state(*parts)
        origin, foot = transferred_heights(*parts)
        law = self.effects.law
        heat = at.temperature_parts if law is not None and law.depends_on_temperature else None
        self.port.enter(at.time, q, v, f, ends, origin=origin, monitor_heat=at.monitor_heat, foot=foot, heat=heat)
