"""`System`: what can be run. A scene of one bearing is one; entry points add kinds that the core does not know.

The core has a function for each thing that can be done with a system, such as `start` and `explain`. Each function
knows the scene of one bearing, and calls the method of the same name of any other system.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from importlib.resources.abc import Traversable
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from msfp_gen.motions.motion import Motion
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.scene_fields import Limits
    from msfp_gen.scene.solver import Solver
    from msfp_gen.specification.layout import ModelSpec

Table = dict[str, Any]
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


@dataclass(frozen=True)
class Kind:
    """A kind of systems that scene files can have.

    Attributes:
        key: the table of a scene file by which the kind is known, such as "building".
        from_table: makes the system of the table of a file; arguments and errors as of `scene_from_table`.
        files: place, table and keys of every table of a file that may name files.
        common: tables inside the table `key` that its rows have unless they have their own.
        presets: folder of TOML files with systems of this kind; None: there are none.
    """

    key: str
    from_table: Callable[..., Any]
    files: Callable[[Mapping[str, Any]], Iterator[tuple[str, Table, tuple[str, ...]]]]
    common: tuple[str, ...] = ()
    presets: Traversable | None = None


@cache
def kinds() -> Mapping[str, Kind]:
    """The kinds of systems beside a scene of one bearing, by their keys; their modules are loaded here."""
    return {point.name: point.load() for point in entry_points(group=GROUP)}
