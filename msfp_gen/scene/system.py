"""`System`: what can be run. A scene of one bearing is one; entry points add kinds that the core does not know.

The core has a function for each thing that can be done with a system, such as `start` and `explain`. Each function
knows the scene of one bearing, and calls the method of the same name of any other system.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

from msfp_gen.common.aliases import SceneTable
from msfp_gen.common.errors import InputError

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene_fields import Limits, Stop
    from msfp_gen.scene.solver import Solver
    from msfp_gen.specification.friction_laws import Law
    from msfp_gen.specification.layout import Effects, ModelSpec

# What an energy balance compares, and the energy to which its difference is relative, in words for reports.
ENERGY_COMPARED = (
    "the work of the ground and the loads was compared with all energy stored and dissipated",
    "peak input",
)
GROUP = "msfp_gen.systems"  # of entry points; the name of each is the `key` of its kind


class System(Protocol):
    """What everything that runs has: a frozen dataclass, so that `replace` changes its fields, such as `duration`."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def name(self) -> str:
        """Label."""

    @property
    def motion(self) -> Motion:
        """Of the ground."""

    @property
    def end(self) -> float:
        """Time at which the run ends [s]."""

    @property
    def solver(self) -> Solver:
        """Method and tolerances."""

    @property
    def stop(self) -> Stop | None:
        """Condition that ends a run before its end; None: it has none. Where there is one, it is a field."""

    @property
    def limits(self) -> Limits | None:
        """Of the device, for the verdict."""

    @property
    def fidelity(self) -> str:
        """Level of the model."""

    @property
    def every_bearing(self) -> tuple[Bearing, ...]:
        """Values of all bearings."""

    @property
    def specs(self) -> tuple[ModelSpec, ...]:
        """Models with which the run starts, each once."""

    @property
    def run_options(self) -> frozenset[str]:
        """Names of the options of `simulate` that a run has, beside progress and checkpoints."""

    @property
    def longest_row_step(self) -> tuple[float, str]:
        """Longest time between two rows [s], infinite where their memory is not counted, and the field that says so."""

    def check_method(self) -> None:
        """Raise InputError where the method does not run the effects with which the system starts."""

    def with_bearings(self, change: Callable[[Bearing, Law | None], Bearing]) -> Self:
        """It with every bearing changed."""

    @property
    def every_effects(self) -> tuple[Effects, ...]:
        """Effects of the models with which the bearings start."""

    def with_effects(self, **changes: Any) -> Self:
        """It with values of `Effects` given for every bearing, without numbers of friction laws that it loses."""

    def with_all_effects(self) -> Self:
        """It with every effect that it has parameters for and does not fix."""

    def with_compared_effects(self) -> Self:
        """It with effects that no run changes on its way, for the methods whose errors are compared."""

    def with_effects_for(self, error: float) -> tuple[Self, str]:
        """It with effects for a run with a relative error [-], and the reasons as text; given effects are kept."""

    @property
    def rows_between_steps(self) -> bool:
        """Whether rows at even times are interpolated, so that `output_step` leaves the steps as they are."""

    def along_axes(self) -> tuple[Self, ...]:
        """It as planar models run it: itself, or one for each horizontal axis of its motion. Raises InputError."""

    @property
    def own_motions(self) -> tuple[str, ...]:
        """Paths of the motions of single bearings, which `motion` does not move."""

    @property
    def energy_compared(self) -> tuple[str, str]:
        """What the energy balance of a run compares, and to what its difference is relative, in words."""

    @property
    def loads_at_rest(self) -> tuple[float, ...]:
        """Axial load of every bearing at rest [N]."""

    def beginning_like(self, others: Sequence[Self]) -> Self:
        """It with every effect with which any of `others` begins."""

    def with_effects_of(self, models: Sequence[str]) -> Self | None:
        """It with every effect of the models with which several runs ended; None where nothing is to be added."""


class OtherSystem(ABC):
    """Base of systems that are no `Scene`: what the functions of the core ask of them. A subclass has `start`.

    It is a frozen dataclass with the fields or properties name, motion, end, limits, fidelity, every_bearing and specs
    of `System`; with a field solver its errors can be measured, with a field duration the run can be made shorter.

    run_options: names of the options of `simulate` that a run has, beside progress and checkpoints.
    """

    run_options: ClassVar[frozenset[str]] = frozenset()
    rows_between_steps: ClassVar[bool] = False
    energy_compared: ClassVar[tuple[str, str]] = ENERGY_COMPARED
    longest_row_step: ClassVar[tuple[float, str]] = (math.inf, "")  # rows of other systems are few
    stop: ClassVar[None] = None
    own_motions: Any = ()  # a property of some kinds, as the next
    comparisons: Any = ()  # of their parts with others; see `report.compared.comparisons_of`
    name: Any

    def text(self) -> str:
        """It as the text of a scene file, for files of results and checkpoints. Raises InputError: it has none."""
        raise InputError(f"{self.name}: this system cannot be written as a scene file; leave the file out")

    def structure(self, table: Mapping[str, Any]) -> Any:
        """Tables and figures of the superstructure; see `report.analysis.structure_of`. table: of the scene file."""
        return [], []

    @abstractmethod
    def start(self, **options: Any) -> Any:
        """The run before its first step; see `simulation.system.Run`. Raises InputError, RunError."""

    def check_method(self) -> None:  # noqa: B027 - other systems check it at their start
        """Raise InputError where the method does not run the effects."""

    def along_axes(self) -> tuple[Any, ...]:
        """It as planar models run it: itself."""
        return (self,)

    def explain(self) -> list[Any]:
        """Tables that describe it; see `scene.explain.explain`."""
        return []

    def refusals(self) -> list[str]:
        """Why values can hardly be meant; see `scene.plausibility.refusals`."""
        return []

    def doubts(self) -> list[str]:
        """What is hardly meant, also what is not refused; see `scene.plausibility.doubts`."""
        return []

    def quantities(self) -> dict[str, Any]:
        """What tables report of a run; see `results.quantities.quantities`."""
        return {}

    def columns(self) -> dict[str, Any]:
        """The columns of a table of all rows; see `results.dataset.columns`."""
        return {}

    @property
    def figures(self) -> Mapping[str, Any]:
        """The figures of a run by their names; see `figures.figures_of`."""
        return {}

    def at_fidelity(self, word: str) -> Any:
        """It at a level of fidelity; see `scene.fidelity.at_fidelity`."""
        raise InputError(f"fidelity = {word!r}: this system has no such model; leave it out")

    def with_bearings(self, change: Callable[[Bearing, Law | None], Bearing]) -> Any:
        """It with every bearing changed. change: of a bearing and its friction law at the start. Raises InputError."""
        raise InputError("this system has no bearings that can be changed")

    @property
    def every_effects(self) -> tuple[Effects, ...]:
        """Effects of the models with which the bearings start; () where the system gives none."""
        return ()

    def with_effects(self, **changes: Any) -> Any:
        """It with values of `Effects` given for every bearing. Raises InputError."""
        raise InputError("the effects of this system cannot be changed")

    def with_all_effects(self) -> Any:
        """It with every effect that it has parameters for and does not fix."""
        return self

    def with_compared_effects(self) -> Any:
        """It with effects that no run changes on its way: with all effects."""
        return self.with_all_effects()

    def with_effects_for(self, error: float) -> tuple[Any, str]:
        """It with effects for a run with a relative error [-], and the reasons as text."""
        return self, "effects as they are selected for every bearing"

    @property
    def loads_at_rest(self) -> tuple[float, ...]:
        """Axial load of every bearing at rest [N]; () where the system gives none."""
        return ()

    def beginning_like(self, others: Sequence[Any]) -> Any:
        """It with every effect with which any of `others`, which differ in values alone, begins."""
        return self

    def with_effects_of(self, models: Sequence[str]) -> Any | None:
        """It with every effect of the models with which several runs ended; None where nothing is to be added."""
        return None


@dataclass(frozen=True)
class Kind:
    """A kind of systems that scene files can have.

    Attributes:
        key: the table of a scene file by which the kind is known, such as "building".
        from_table: makes the system of the table of a file; arguments and errors as in `scene_from_table`.
        files: place, table and keys of every table of a file that may name files.
        common: tables inside the table `key` that its rows have unless they have their own.
        presets: folder of TOML files with systems of this kind; None: there are none.
        result: gives the class of their results, for files of results; None: there are no such files.
        written_out: the table `key` with what it abbreviates written out, to which paths of fields refer.
        named: the table of a file that has bearings by name, to which its rows refer; None: there is none.
    """

    key: str
    from_table: Callable[..., Any]
    files: Callable[[Mapping[str, Any]], Iterator[tuple[str, SceneTable, tuple[str, ...]]]]
    common: tuple[str, ...] = ()
    presets: Traversable | None = None
    result: Callable[[], Any] | None = None
    written_out: Callable[[SceneTable], SceneTable] = lambda table: table
    named: str | None = None


def is_system(value: object) -> bool:
    """Whether a value can be run."""
    return hasattr(type(value), "run_options")


def require_field(system: Any, name: str, without: str) -> None:
    """Raise InputError for a system without a field. without: what follows, or the remedy."""
    if name not in system.__dataclass_fields__:
        raise InputError(f"{system.name}: this system has no field {name}; {without}")


@cache
def kinds() -> Mapping[str, Kind]:
    """The kinds of systems beside a scene of one bearing, by their keys; their modules are loaded here."""
    from importlib.metadata import entry_points  # slow, as it imports the parser of mails

    return {point.name: point.load() for point in entry_points(group=GROUP)}
