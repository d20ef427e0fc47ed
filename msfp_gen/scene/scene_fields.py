"""The fields of a scene, and limits of the device: what effect selection works on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Choice, Quantity, check_fields
from msfp_gen.common.identity import NO_NUMBERS
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.friction_parameters import select_friction
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import Top
from msfp_gen.specification import contract
from msfp_gen.specification.friction_laws import Law, law_of
from msfp_gen.specification.layout import Auto, Effects
from msfp_gen.specification.values import rules

_RUN = rules((*contract.RUN, *contract.ARRAYS))


_FORCE, _LENGTH, _TIME = Quantity("N", above=0.0), Quantity("m", above=0.0), Quantity("s", above=0.0)


@dataclass(frozen=True)
class Limits:
    """Limits of a bearing, in a building of each bearing. No number of a run depends on them, only its verdict.

    rim_force: of a rim [N]; None: a third of the axial load at rest, or of the largest normal force if the load varies.
    rim_compression: of a rim [m]; None: a tenth of the capacity of its surface. uplift_height: clearance between the
    faces of a surface [m]; None: the height at which its rim acts, the rim_offset of its slider. uplift_duration:
    longest time for which a surface is open [s]. temperature: at the centre of a surface [degC]. axial_load: largest
    vertical force on the structure [N]; None: no limit. displacement: largest horizontal displacement [m]; None: no
    limit. Raises InputError.
    """

    rim_force: Annotated[float | None, _FORCE] = None
    rim_compression: Annotated[float | None, _LENGTH] = None
    uplift_height: Annotated[float | None, _LENGTH] = None
    uplift_duration: Annotated[float, _TIME] = 0.1
    temperature: Annotated[float, Quantity("degC", above=-273.15)] = 250.0
    axial_load: Annotated[float | None, _FORCE] = None
    displacement: Annotated[float | None, _LENGTH] = None

    def __post_init__(self) -> None:
        check_fields(self, "limits")


FIDELITIES = {
    "exact": "the scene as it is given",
    "loose": "a loose tolerance",
    "massless": "sliders without inertia, at a loose tolerance",
    "equivalent": "one pendulum with the main regime of the published backbone",
    "rigid": "of a building: one rigid body on massless bearings",
}
Fidelity = Annotated[str, Choice(FIDELITIES)]
Triples = tuple[tuple[float, float, float], ...]
Pairs = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class InitialState:
    """Initial state of a run, as nested tuples; arrays and lists are accepted too.

    q: angles psi, theta, phi of bodies 2..n, shape (n-1, 3) [rad]. v: their rates, same shape [rad/s].
    h: friction state Y, Z of each surface, shape (n-1, 2) [-], within the unit disc (2.94). The displacement across the
    bearing counts from this state, its sliding and its gaps from the centre of each dish. Raises InputError.
    """

    q: Annotated[Triples, replace(_RUN["q"], shape=(None, 3))]
    v: Annotated[Triples, replace(_RUN["v"], shape=(None, 3))]
    h: Annotated[Pairs, replace(_RUN["f"], shape=(None, 2))]

    def __post_init__(self) -> None:
        check_fields(self, "initial_state")
        for index, (first, second) in enumerate(self.h):
            if first**2 + second**2 > contract.LARGEST_FRICTION_STATE:
                raise InputError(
                    f"initial_state.h[{index}] = {(first, second)}: friction cannot exceed mu N; give Y^2 + Z^2 <= 1"
                )


@dataclass(frozen=True)
class Stop:
    """Conditions that end a run before its duration; the first that is met counts.

    displacement: horizontal displacement across the bearing, from its start [m]. all_rims: every rim is in contact.
    Raises InputError.
    """

    displacement: Annotated[float | None, _RUN["stop_displacement"]] = None
    all_rims: bool = False

    def __post_init__(self) -> None:
        check_fields(self, "stop")
        if self.displacement is None and not self.all_rims:
            raise InputError("stop: nothing to stop at; give displacement [m] or all_rims = true")


@dataclass(frozen=True)
class SceneFields:
    """The fields of a `Scene`, without the checks that they are consistent."""

    bearing: Bearing
    motion: Motion
    top: Top
    effects: Effects | Auto = field(default_factory=Auto)
    solver: Solver = field(default_factory=Solver)
    duration: Annotated[float | None, Quantity("s", above=0.0)] = None
    initial_state: InitialState | None = None
    output_step: Annotated[float | None, _RUN["output_step"]] = None
    stop: Stop | None = None
    load: Load | None = None
    top_rotation: Rotation | None = None
    name: str = ""
    limits: Limits | None = field(default=None, metadata=NO_NUMBERS)
    fidelity: Fidelity = field(default="exact", metadata=NO_NUMBERS)
    motion_table: Mapping[str, Any] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Nothing here; the constructor, which `Scene` shares, calls the checks of `Scene` by this name."""

    @cached_property
    def law(self) -> tuple[str, Law | None]:
        """Friction law at the start of a run: the word of `Effects.friction`, and the law (None: constant friction)."""
        word = self.effects.friction or select_friction(self.bearing, self.effects.friction_law)
        return word, law_of(word, self.effects.friction_law)

    @cached_property
    def end(self) -> float:
        """Latest time at which the run ends [s]."""
        return self.motion.duration if self.duration is None else min(self.duration, self.motion.duration)
