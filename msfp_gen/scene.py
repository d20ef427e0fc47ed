"""One run, complete: a bearing, the motion of its base, what stands on it, what is modelled and how it is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

from msfp_gen.bearing import Bearing
from msfp_gen.errors import InputError
from msfp_gen.fields import Quantity, check_fields, require_type
from msfp_gen.generator.friction_laws import HEAT_TIMES, Law, law_of
from msfp_gen.law_choice import friction_of
from msfp_gen.law_numbers import check_bearing
from msfp_gen.layout import Auto, Effects, ModelSpec
from msfp_gen.motion import Motion
from msfp_gen.prescribed import Load, Rotation
from msfp_gen.solver import Solver
from msfp_gen.top import Top

if TYPE_CHECKING:
    from msfp_gen.choice import Choice

_TIME = Quantity("s", above=0.0)
MOST_ROWS = 1e8  # of output: some 100 GB
Triples = tuple[tuple[float, float, float], ...]
Pairs = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class InitialState:
    """Where a run starts, as nested tuples; arrays and lists are taken too.

    q: angles psi, theta, phi of bodies 2..n, shape (n-1, 3) [rad]. v: their rates [rad/s].
    h: Bouc-Wen Y, Z of each surface, shape (n-1, 2), within the unit disc. Raises InputError.
    """

    q: Annotated[Triples, Quantity("rad", shape=(None, 3))]
    v: Annotated[Triples, Quantity("rad/s", shape=(None, 3))]
    h: Annotated[Pairs, Quantity("", shape=(None, 2))]

    def __post_init__(self) -> None:
        check_fields(self, "initial_state")
        for index, (first, second) in enumerate(self.h):
            if first**2 + second**2 > 1 + 1e-9:
                raise InputError(
                    f"initial_state.h[{index}] = {(first, second)}: friction cannot exceed mu N; give Y^2 + Z^2 <= 1"
                )


@dataclass(frozen=True)
class Stop:
    """What ends a run before its duration.

    displacement: across the bearing, horizontally [m]. all_rims: every rim is in contact. Raises InputError.
    """

    displacement: Annotated[float | None, Quantity("m", above=0.0)] = None
    all_rims: bool = False

    def __post_init__(self) -> None:
        check_fields(self, "stop")
        if self.displacement is None and not self.all_rims:
            raise InputError("stop: nothing to stop at; give displacement [m] or all_rims = true")


@dataclass(frozen=True)
class Scene:
    """Everything `simulate` needs.

    duration [s]; None: as long as the motion. initial_state; None: centred and at rest. output_step [s]; None: the
    solver's own steps. stop: what ends the run early. motion_table: the motion as a scene file writes it, kept so that
    the scene can be written back. load: on the top plate, beside what the top applies. top_rotation: how what the top's
    rotational stiffness is fixed to turns. effects: what is modelled, or `Auto`: chosen from the scene. Raises
    InputError: a part of the wrong kind, or parts that do not fit together.
    """

    bearing: Bearing
    motion: Motion
    top: Top
    effects: Effects | Auto = field(default_factory=Auto)
    solver: Solver = field(default_factory=Solver)
    duration: Annotated[float | None, _TIME] = None
    initial_state: InitialState | None = None
    output_step: Annotated[float | None, _TIME] = None
    stop: Stop | None = None
    load: Load | None = None
    top_rotation: Rotation | None = None
    name: str = ""
    motion_table: Mapping[str, Any] | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        for name, kind in _KINDS.items():
            require_type(getattr(self, name), kind, f"scene.{name}")
        check_fields(self, "scene")
        self._check_times()
        self._check_sizes()
        word, law = self.law
        check_bearing(law, word, self.bearing)
        if self.effects.rims is not False:
            self._check_rims()
        elif self.stop is not None and self.stop.all_rims:
            raise InputError("stop.all_rims = True: effects.rims = False models no rims; give rims = true")
        self._check_rotation()
        if self.effects.dimension == "planar":
            self._check_plane()

    @property
    def spec(self) -> ModelSpec:
        """Which model the run needs, or begins with."""
        return ModelSpec(self.bearing.layout, self.modelled)

    @property
    def law(self) -> tuple[str, Law | None]:
        """The law of the friction coefficient that a run begins with: its word, and its formula (None: constant)."""
        word = self.effects.friction or friction_of(self.bearing, self.effects.friction_law)
        return word, law_of(word, self.effects.friction_law)

    @property
    def modelled(self) -> Effects:
        """The effects a run begins with: the given ones, or those chosen from the scene."""
        return self.choice.effects

    @cached_property
    def choice(self) -> Choice:
        """The effects a run begins with and the reason for each."""
        from msfp_gen.choice import choose

        return choose(self)

    @property
    def end(self) -> float:
        """Time at which the run ends at the latest [s]."""
        return self.motion.duration if self.duration is None else min(self.duration, self.motion.duration)

    def _check_times(self) -> None:
        if self.duration is not None and self.duration > self.motion.duration * (1 + 1e-12):  # rounding is forgiven
            raise InputError(
                f"duration = {self.duration}: the motion lasts {self.motion.duration:.12g} s; give at most that, or "
                "hold the motion at its end (motion.hold in a scene file, motion.held(...) in Python)"
            )
        word, law = self.law
        if law is not None and law.heats and self.end > HEAT_TIMES[1]:
            raise InputError(
                f"duration = {self.end:.12g}: effects.friction = {word!r} follows the heat of "
                f"friction for {HEAT_TIMES[1]:g} s; give at most that, or a law without temperature"
            )
        if self.output_step is not None and self.output_step > self.end:
            raise InputError(f"output_step = {self.output_step}: give at most the duration, {self.end:.12g} [s]")
        if self.output_step is not None and self.end / self.output_step > MOST_ROWS:
            raise InputError(
                f"output_step = {self.output_step}: {self.end / self.output_step:.1e} rows are more than a machine "
                f"holds; give at least {self.end / MOST_ROWS:.2g} [s]"
            )

    def _check_sizes(self) -> None:
        state, count = self.initial_state, self.bearing.layout.surfaces
        for name in ("q", "v", "h") if state is not None else ():
            rows = len(getattr(state, name))
            if rows != count:
                layout = self.bearing.layout.name
                raise InputError(f"initial_state.{name} has {rows} rows: layout {layout} needs {count}")

    def _check_rims(self) -> None:
        for index, surface in enumerate(self.bearing.surfaces):
            body = self.bearing.slider(index)
            if self.bearing.slider_rim_radius(index) == 0:
                path = f"bearing.bodies[{body - 1}].rim_radius" if body else "bearing.base_rim_radius"
                raise InputError(
                    f"{path} = 0 (body {body + 1}): this body meets the rim of surface {index + 1}; give the radius "
                    "of its rim [m], or effects.rims = false"
                )
            if surface.rim_stiffness == 0:
                raise InputError(
                    f"bearing.surfaces[{index}].rim_stiffness = 0 (surface {index + 1}): such a rim stops nothing; "
                    "give a stiffness [N/m], or effects.rims = false"
                )

    def _check_rotation(self) -> None:
        stiff = getattr(self.top, "rotational_stiffness", 0.0) or getattr(self.top, "rotational_damping", 0.0)
        if self.top_rotation is not None and not stiff:
            raise InputError(
                f"top_rotation: a {self.top.kind} top without rotational_stiffness passes no rotation on; give it one "
                "[N m/rad]"
            )
        if isinstance(self.effects, Effects) and self.effects.top_rotation != (self.top_rotation is not None):
            remedy = "give top_rotation, or leave the effect out" if self.effects.top_rotation else "set it to True"
            raise InputError(f"effects.top_rotation = {self.effects.top_rotation}: not what the scene holds; {remedy}")

    def _check_plane(self) -> None:
        from msfp_gen.drive import plane_of

        plane, until, what = plane_of(self)
        if until < self.end:
            where = f"leaves the vertical plane at azimuth {plane:.6g} rad from {until:.6g} s on"
            if what == "motion" and until == 0:
                where = "lies in no vertical plane"
            raise InputError(f"effects.dimension = 'planar': the {what} {where}; give effects.dimension = 'spatial'")


_KINDS: dict[str, type | tuple[type, ...]] = {
    "bearing": Bearing,
    "motion": Motion,
    "top": Top,
    "effects": (Effects, Auto),
    "solver": Solver,
    "initial_state": (InitialState, type(None)),
    "stop": (Stop, type(None)),
    "load": (Load, type(None)),
    "top_rotation": (Rotation, type(None)),
}
