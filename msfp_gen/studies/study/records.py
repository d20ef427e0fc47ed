"""`[records]` of a study: the motions, the axes `record` and `scale`, and the intensity measure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msfp_gen.common.fields import Choice, Quantity, check_fields
from msfp_gen.common.inputs import is_input
from msfp_gen.errors import InputError
from msfp_gen.scene.file.suite import Suite, load_suite, suite_from_table
from msfp_gen.studies.study.axes import Axis, grid
from msfp_gen.studies.study.fields import fields_of, known_keys

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion

Table = dict[str, Any]
Progress = Callable[[float, float], None]
KEYS = ("suite", "motions", "scales", "intensity")
NOUN = "a table with motions or the file of a suite, and scales"
COMPONENTS = ("E1", "E2", "E3", "geomean", "rotd50", "rotd100")


@dataclass(frozen=True)
class Intensity:
    """The intensity measure of a record: spectral pseudo-acceleration, or peak ground acceleration without a period.

    period [s], damping: of the oscillator. component: of the spectrum. Raises InputError.
    """

    period: Annotated[float | None, Quantity("s", above=0.0)] = None
    damping: Annotated[float, Quantity("", above=0.0)] = 0.05
    component: Annotated[str, Choice(COMPONENTS)] = "geomean"

    def __post_init__(self) -> None:
        check_fields(self, "records.intensity")

    def of(self, motion: Motion) -> float:
        """The measure of a motion [m/s^2]."""
        from msfp_gen.motions.records.spectrum import MEASURES, response_spectrum

        spectrum = response_spectrum(motion, [self.period or 1.0], damping=self.damping)
        values = spectrum.pga if self.period is None else spectrum.psa[0]
        return float(values[MEASURES.index(self.component)])


@dataclass(frozen=True)
class Records:
    """What `[records]` gives.

    Attributes:
        axes: `record`, and `scale` where scales are given; none without `[records]`.
        tables: name -> `[motion]` table, without its key `kind`; paths are absolute.
        intensities: name -> intensity measure at scale 1 [m/s^2]; empty where none is asked for.
        table: `[records]` with the motions in it; empty without `[records]`.
    """

    axes: tuple[Axis, ...]
    tables: dict[str, Table]
    intensities: dict[str, float]
    table: Table


def records_from(table: Any, folder: Path | None, progress: Progress | None) -> Records:
    """The records of a table `[records]`; None: none. folder: of the study file. Raises InputError."""
    if table is None:
        return Records((), {}, {}, {})
    if not isinstance(table, Mapping):
        raise InputError(f"records = {table!r}: give {NOUN}")
    known_keys(table, KEYS, "records.")
    suite = _suite(table, folder, progress)
    axes = [grid(Axis("record", "record"), [record.name for record in suite.records])]
    if (scales := table.get("scales")) is not None:
        axes.append(_scales(scales))
    tables = {record.name: record.table for record in suite.records}
    intensities = {}
    if "intensity" in table:
        measure = Intensity(**fields_of(table, "intensity", Intensity, "records."))
        intensities = {record.name: measure.of(record.motion) for record in suite.records}
        if weak := [name for name, value in intensities.items() if not value > 0]:
            raise InputError(f"records.intensity: record {weak[0]!r} has none in this component; give another")
    complete = {"motions": [*tables.values()], "scales": scales, "intensity": table.get("intensity")}
    return Records(tuple(axes), tables, intensities, complete)


def _suite(table: Mapping[str, Any], folder: Path | None, progress: Progress | None) -> Suite:
    if ("suite" in table) == ("motions" in table):
        raise InputError("records: give suite, the path of a suite file, or motions, a list of [[records.motions]]")
    if "suite" in table:
        if not isinstance(table["suite"], str):
            raise InputError(f"records.suite = {table['suite']!r}: give a path in quotes")
        path = (folder or Path()) / table["suite"]
        return load_suite(path if is_input(path) else table["suite"], progress)
    try:
        return suite_from_table({"records": table["motions"]}, folder, progress)
    except InputError as error:
        raise InputError(f"records.motions: {error}") from None


def _scales(values: Any) -> Axis:
    try:
        axis = grid(Axis("scale", "scale"), values)
    except InputError as error:
        raise InputError(f"records.scales: {error}") from None
    if not axis.numeric or min(axis.labels) <= 0:
        raise InputError(f"records.scales = {values!r}: give numbers above 0")
    return axis
