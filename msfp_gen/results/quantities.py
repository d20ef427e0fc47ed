"""The quantities of a run that tables, studies and bounds report: names, units, and places in its summary."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import singledispatch
from typing import Any, Literal, NamedTuple

from msfp_gen.scene.scene import Scene

Side = Literal["most", "least", ""]


class RunQuantity(NamedTuple):
    """A quantity of a run.

    path: dotted path of the value in the summary, or in the characterisation if `characterised`; `.*` stands for each
    surface, floor, storey or bearing, bottom first or in the order of the file, and gives one column for each. governs:
    whether the largest or the least value governs a design; "" if neither does. at_rest: whether the quantity is
    defined only if the run ends at rest. of_parts: whether it is of parts of a building, which suites compare and
    bounds do not. kept: whether a study keeps it where its file names no quantities. extreme: whether it is the largest
    or the least value over the run; None: as `governs`. words: in tables and figures, in place of the column's.
    where: attribute of the characterisation that names the place of the value, and its share of what is allowed there.
    apart: whether it is no part of the summary, and made only where a study keeps it.
    """

    unit: str
    path: str
    governs: Side = ""
    characterised: bool = False
    at_rest: bool = False
    of_parts: bool = False
    kept: bool = False
    extreme: Side | None = None
    words: str = ""
    where: str = ""
    apart: bool = False

    @property
    def side(self) -> Side:
        """How a run that ended early bounds the value: "most" from below, "least" from above, "" not at all."""
        return self.governs if self.extreme is None else self.extreme


RUN = {
    "status": RunQuantity("", "status"),
    "message": RunQuantity("", "message"),
    "duration": RunQuantity("s", "duration", extreme="most"),
    "peak_displacement": RunQuantity("m", "peak_displacement.radial", "most", kept=True),
    "peak_force": RunQuantity("N", "peak_force.radial", "most", kept=True),
    "peak_force_ratio": RunQuantity("", "peak_force_ratio", extreme="most"),
    "rims_met": RunQuantity("", "rims_met", kept=True),
    "verdict": RunQuantity("", "verdict.word"),
    "verdict_text": RunQuantity("", "verdict.text"),
    "limits_exceeded": RunQuantity("", "verdict.limits", kept=True),
    "limits_reached": RunQuantity(
        "", "verdict.largest"
    ),  # as JSON: of every limit the value largest over what is allowed
    "closure_error": RunQuantity("", "energy.closure_error"),
    "steps": RunQuantity("", "counters.steps", extreme="most"),
    "wall_time": RunQuantity("s", "wall_time"),
    "secant_stiffness": RunQuantity("N/m", "secant_stiffness", characterised=True),
    "energy_dissipated": RunQuantity("J", "energy_dissipated", characterised=True, extreme="most"),
    "residual_displacement": RunQuantity(
        "m", "residual_displacement", "most", characterised=True, at_rest=True, extreme=""
    ),
    # means over the cycles
    "effective_stiffness": RunQuantity("N/m", "envelope.effective_stiffness.mean", characterised=True),
    "effective_period": RunQuantity("s", "envelope.effective_period.mean", characterised=True),
    "effective_damping": RunQuantity("", "envelope.effective_damping.mean", characterised=True),
    "zero_displacement_force": RunQuantity("N", "envelope.zero_displacement_force.mean", characterised=True),
}
BEARING = RUN | {
    "axial_load": RunQuantity("N", "axial_load"),
    "peak_input_energy": RunQuantity("J", "energy.peak_input", extreme="most"),
    "dissipated_share": RunQuantity("", "energy.dissipated_share"),
    "capacity_used": RunQuantity("", "capacity_used.*", extreme="most"),  # 1 where a slider meets its rim
    "peak_sliding": RunQuantity("m", "peak_sliding.*", kept=True, extreme="most"),
    "minimum_gap": RunQuantity("m", "minimum_gap.*", extreme="least"),
    "minimum_normal_force": RunQuantity("N", "minimum_normal_force.*", extreme="least"),
    "minimum_load_ratio": RunQuantity(
        "", "minimum_load_ratio", "least", words="least normal force over the load at rest"
    ),
    "maximum_normal_force": RunQuantity("N", "maximum_normal_force.*", extreme="most"),
    "least_friction": RunQuantity("", "least_friction.*", extreme="least"),
    "most_friction": RunQuantity("", "most_friction.*", extreme="most"),
    "peak_temperature": RunQuantity("degC", "peak_temperature.*", extreme="most"),
    "peak_rim_force": RunQuantity("N", "peak_rim_force.*", extreme="most"),
    "uplift_height": RunQuantity("m", "uplift.height", extreme="most"),
    "uplift_duration": RunQuantity("s", "uplift.duration", extreme="most"),
    "maximum_uplift": RunQuantity("m", "maximum_uplift", "most", characterised=True),
    "capacity_left": RunQuantity("m", "surfaces.*.capacity_left", "least", characterised=True),
    "peak_velocity": RunQuantity("m/s", "surfaces.*.peak_velocity", "most", characterised=True),
    "peak_heat_flux": RunQuantity("W/m^2", "surfaces.*.peak_heat_flux", "most", characterised=True),
}


MOVING = "the run ends while the bearing still moves: give motion.hold, such as 20 s, for time without motion"


class ColumnSource(NamedTuple):
    """Where the value of a column comes from: a quantity of the run, or of one of its parts.

    place: index from 0 of the surface, floor, storey or bearing; None: of the run. part: name of that part in messages.
    """

    quantity: RunQuantity
    place: int | None = None
    part: str = ""

    def reason(self, characterisation: Any) -> str:
        """Why a characterised run has no value of the quantity; "" where no reason is known."""
        moving = characterisation is not None and not characterisation.at_rest
        return MOVING if moving and self.quantity.at_rest else ""

    def words(self, column: str) -> str:
        """The quantity in words, with the name of its part. column: its name."""
        own = column.rpartition("_")[0] if self.part else column
        words = self.quantity.words or own.replace("_", " ")
        return words + (f" of {self.part}" if self.part else "")

    @property
    def compared(self) -> bool:
        """Whether `bound` compares the quantity; quantities of parts of a building are compared in suites only."""
        quantity = self.quantity
        return not quantity.of_parts and (quantity.characterised or bool(quantity.governs))

    def value(self, entry: Callable[[str], Any], characterisation: Any) -> Any:
        """The value of the quantity; None where the run has none.

        entry: of the summary at a key, such as `result.entry`, which makes no other.
        characterisation: of the run; None where it is not needed, or not possible.
        """
        quantity = self.quantity
        if quantity.at_rest and (characterisation is None or not characterisation.at_rest):
            return None
        if quantity.characterised:
            value = value_at(characterisation, quantity.path)
        else:
            head = quantity.path.partition(".")[0]
            value = value_at({head: entry(head)}, quantity.path)
        if self.place is None or value is None:
            return value
        return value[self.place] if self.place < len(value) else None


@singledispatch
def quantities(system: Any) -> dict[str, ColumnSource]:
    """Column of a table -> where its value comes from in the result of a system."""
    sources: dict[str, ColumnSource] = system.quantities()
    return sources


@quantities.register(Scene)
def _quantities_of_bearing(scene: Scene) -> dict[str, ColumnSource]:
    return sources_of(BEARING, {}, len(scene.bearing.surfaces))


def sources_of(
    table: Mapping[str, RunQuantity], parts: Mapping[str, Sequence[str]], surfaces: int
) -> dict[str, ColumnSource]:
    """Column -> source of every quantity of a table; one for each part of a quantity of several.

    parts: names of the floors, storeys or bearings. surfaces: number of surfaces, for all other quantities of several.
    """
    sources: dict[str, ColumnSource] = {}
    for name, quantity in table.items():
        head, several, _ = quantity.path.partition(".*")
        if not several:
            sources[name] = ColumnSource(quantity)
            continue
        labels = parts.get(head) or [f"surface {number}" for number in range(1, surfaces + 1)]
        sources |= {f"{name}_{index + 1}": ColumnSource(quantity, index, label) for index, label in enumerate(labels)}
    return sources


def value_at(table: Any, path: str) -> Any:
    """The value at a dotted path of keys or attributes, None where there is none; `*` gives a list over all rows."""
    value = table
    head, several, rest = path.partition(".*")
    for part in head.split("."):
        value = value.get(part) if isinstance(value, Mapping) else getattr(value, part, None)
    if not several or value is None:
        return value
    return [value_at(row, rest.lstrip(".")) for row in value] if rest else value
