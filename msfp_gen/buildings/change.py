"""`Change`: a bearing that continues with another model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.note import Note

BearingNotes = tuple[tuple[int, Note], ...]
"""Notes of monitors, each with the bearing that it is about, from 0."""


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
