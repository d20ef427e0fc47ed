"""`Parameter`: one number of a scene, by its path, with unit and value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """One number of a scene.

    Attributes:
        path: such as `bearing.surfaces[0].friction`.
        part: "bearing", "surfaces", "bodies", "top", "motion", "load" or "initial_state".
        field: name of the field of that part.
        index: of the surface or body, then of the component of the field; indices count from zero.
        unit: SI unit; "" for a plain number.
        value: in the scene.
        least, above: bounds that its field has, inclusive and exclusive [unit]; None: unbounded.
    """

    path: str
    part: str
    field: str
    index: tuple[int, ...]
    unit: str
    value: float
    least: float | None = None
    above: float | None = None

    def __str__(self) -> str:
        return f"{self.path} = {self.value:g}" + (f" {self.unit}" if self.unit else "")
