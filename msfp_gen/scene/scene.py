"""`Scene`: the complete input of a run, and the checks that its parts are consistent."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import check_fields, require_type
from msfp_gen.common.tables import LabelledValues, Printed
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load, Rotation
from msfp_gen.motions.time_grid import TIME_TOLERANCE
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.effect_selection import EffectSelection, load_at_rest, select_effects
from msfp_gen.scene.effect_switching import all_effects, check_effects
from msfp_gen.scene.friction_parameters import bearing_for, check_bearing
from msfp_gen.scene.planarity import along, scene_plane
from msfp_gen.scene.scene_fields import InitialState, Limits, SceneFields, Stop
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.standing import check_seats, check_standing, standing_of
from msfp_gen.scene.system import ENERGY_COMPARED
from msfp_gen.scene.top import NodeTop, Top
from msfp_gen.specification import contract
from msfp_gen.specification.friction_laws import LONGEST, Law
from msfp_gen.specification.layout import Auto, Effects, ModelSpec

# Word in the name of a model -> (field of `Auto`, value) that gives the effect.
WIDER: dict[str, tuple[str, Any]] = {
    "spatial": ("dimension", "spatial"),
    "inertial": ("sliders", "inertial"),
    "rims": ("rims", True),
    "uplift": ("uplift", True),
    "pvt": ("friction", "pvt"),
}


def effects_named(models: Iterable[str]) -> dict[str, Any]:
    """Effects in the names of models, as `provenance` has them: field of `Auto` -> value."""
    words = set(re.split(", then |, |-", ", ".join(models)))
    return {name: value for word, (name, value) in WIDER.items() if word in words}


@dataclass(frozen=True, init=False, repr=False)
class Scene(Printed, SceneFields):
    """The complete input of `simulate`.

    bearing, motion (of the base), top, solver: see their classes. duration [s]; None: the duration of the motion.
    initial_state; None: centred and at rest. output_step: time between rows [s]; None: the steps of the solver.
    stop: condition that ends the run early. load: load history on the top plate, in addition to the load of the top.
    top_rotation: rotation history of the support to which the rotational springs of the top are fixed. effects: the
    effects that are modelled, or `Auto`: selected from the scene. limits: of the bearing, for the verdict of the
    run; None: `Limits()`. fidelity: the level of simplification of the scene, for the notes of the run. motion_table:
    the `[motion]` table of a scene file, from which the scene can be written back. Raises InputError: a part of the
    wrong type, or inconsistent parts.
    """

    run_options: ClassVar[frozenset[str]] = frozenset({"strict", "gradients", "energy_gradients", "gradient_errors"})
    rows_between_steps: ClassVar[bool] = True
    energy_compared: ClassVar[tuple[str, str]] = ENERGY_COMPARED
    own_motions: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for name, kind in _PART_TYPES.items():
            require_type(getattr(self, name), kind, f"scene.{name}")
        check_fields(self, "scene")
        if isinstance(self.top, NodeTop):
            raise InputError("top = Top.node(...): another program moves it; give it to TwoPort, or give Top.rig(...)")
        self._check_times()
        self._check_sizes()
        word, law = self.law
        check_bearing(law, word, self.effects.spin, self.bearing)
        check_seats(self.bearing, self.top, self.effects)
        if standing := standing_of(self):
            check_standing(*standing)
        if self.effects.rims is not False:
            self._check_rims()
        elif self.stop is not None and self.stop.all_rims:
            raise InputError("stop.all_rims = True: effects.rims = False models no rims; give rims = true")
        self._check_rotation()
        if self.effects.dimension == "planar":
            self._check_plane()

    def printed_rows(self) -> tuple[str, LabelledValues]:
        """The parts of the scene in six rows at most."""
        layout, motion, effects = self.bearing.layout, self.motion, self.effects
        names = [f"{name} = {value}" for name, value in vars(effects).items() if value is not None]
        selected = isinstance(effects, Auto)
        extras = [
            name
            for name in ("load", "top_rotation", "initial_state", "stop", "limits")
            if getattr(self, name) is not None
        ]
        radii, friction = ([getattr(s, name) for s in self.bearing.surfaces] for name in ("radius", "friction"))
        rows = {
            "bearing": f"(n, m, p) = {layout.name}, R = {radii} m, mu = {friction}",
            "motion": f"{motion.name or 'unnamed'}, {motion.duration:.6g} s",
            "top": " ".join(repr(self.top).split()),
            "effects": ("selected from the scene, " if selected else "") + ", ".join(names),
            "solver": f"{self.solver.method}, rtol {self.solver.rtol:g}, until {self.end:.6g} s",
            **({"also": ", ".join(extras)} if extras else {}),
        }
        return f"Scene {self.name or 'without a name'}", list(rows.items())

    @property
    def spec(self) -> ModelSpec:
        """Layout and effects of the model with which the run starts."""
        return ModelSpec(self.bearing.layout, self.modelled)

    @property
    def specs(self) -> tuple[ModelSpec, ...]:
        """`spec` as a tuple, as a scene of a building has it."""
        return (self.spec,)

    @property
    def every_bearing(self) -> tuple[Bearing, ...]:
        """The bearing as a tuple, as a scene of a building has it."""
        return (self.bearing,)

    @property
    def longest_row_step(self) -> tuple[float, str]:
        """Longest time between two rows [s], infinite where nothing limits it, and the field that limits it."""
        if self.output_step is not None:
            return self.output_step, "output_step"
        return self.solver.max_step or math.inf, "solver.max_step"

    def check_method(self) -> None:
        """Raise InputError where the method does not support the effects at the start of the run."""
        check_effects(self, self.modelled)

    @property
    def modelled(self) -> Effects:
        """The effects at the start of the run: as given, or selected from the scene."""
        return self.effect_selection.effects

    @cached_property
    def effect_selection(self) -> EffectSelection:
        """The effects at the start of the run, with the reason for each selection."""
        return select_effects(self)

    def with_bearings(self, change: Callable[[Bearing, Law | None], Bearing]) -> Self:
        """The scene with its bearing changed. change: gives another bearing for a bearing and its law at the start."""
        return replace(self, bearing=change(self.bearing, self.law[1]))

    @property
    def every_effects(self) -> tuple[Effects, ...]:
        """The effects at the start of the run, of the one bearing."""
        return (self.modelled,)

    def with_effects(self, **changes: Any) -> Self:
        """The scene with other values of `Effects`, without the numbers of a friction law that is then unused."""
        effects = replace(self.effects, **changes)
        return replace(self, effects=effects, bearing=bearing_for(self.bearing, changes.get("friction")))

    def with_all_effects(self) -> Self:
        """The scene with every effect that it has parameters for and does not fix; itself where effects are given."""
        return self if isinstance(self.effects, Effects) else replace(self, effects=all_effects(self))

    def with_compared_effects(self) -> Self:
        """The scene with all effects, with uplift only where it is selected at the start: most methods have none.

        A run in which a surface opens then fails.
        """
        complete = self.with_all_effects()
        return self if complete is self else complete.with_effects(uplift=self.modelled.uplift)

    def with_effects_for(self, error: float) -> tuple[Self, str]:
        """The scene with effects selected for half of an error [-], and the reasons; the method has the other half."""
        effects = self.effects
        if isinstance(effects, Effects):
            return self, f"effects as the scene has them: {effects.dimension}, {effects.sliders} sliders"
        scene = replace(self, effects=replace(effects, error=min(effects.error, error / 2)))
        reasons = scene.effect_selection.reasons
        return scene, "; ".join(f"{reason.effect} = {reason.chosen}: {reason.because}" for reason in reasons)

    def along_axes(self) -> tuple[Self, ...]:
        """The scene; where its motion leaves any vertical plane, one for each horizontal axis. Raises InputError."""
        if self.motion.plane() is not None:
            return (self,)
        return tuple(replace(self, motion=along(self.motion, axis), motion_table=None) for axis in (0, 1))

    @property
    def loads_at_rest(self) -> tuple[float, ...]:
        """Axial load of the one bearing at rest [N]."""
        return (load_at_rest(self),)

    def beginning_like(self, others: Sequence[Self]) -> Self:
        """The scene itself: a run adds the effects that it needs, and `with_effects_of` gives them to all scenes."""
        return self

    def with_effects_of(self, models: Sequence[str]) -> Self | None:
        """The scene with every effect of several models, by their names; None where they are the same, or given."""
        if not isinstance(self.effects, Auto) or len(set(models)) < 2:
            return None
        return replace(self, effects=replace(self.effects, **effects_named(models)))

    def _check_times(self) -> None:
        if self.duration is not None and self.duration > self.motion.duration * (1 + 1e-12):  # tolerance for rounding
            raise InputError(
                f"duration = {self.duration}: the motion lasts {self.motion.duration:.12g} s; give at most that, or "
                "hold the motion at its end (motion.hold in a scene file, motion.held(...) in Python)"
            )
        if self.end <= TIME_TOLERANCE:
            raise InputError(
                f"duration = {self.end:.3g}: no step is shorter than {TIME_TOLERANCE:g} s; give a longer duration or a "
                "slower motion"
            )
        word, law = self.law
        if law is not None and law.depends_on_temperature and self.end > LONGEST:
            raise InputError(
                f"duration = {self.end:.12g}: effects.friction = {word!r} computes frictional "
                f"heating for {LONGEST:g} s; give at most that, or a law without temperature"
            )
        if self.output_step is not None and self.output_step > self.end:
            raise InputError(f"output_step = {self.output_step}: give at most the duration, {self.end:.12g} [s]")
        if self.output_step is not None and self.end / self.output_step > contract.MAX_ROWS:
            raise InputError(
                f"output_step = {self.output_step}: {self.end / self.output_step:.1e} rows exceed the limit of "
                f"{contract.MAX_ROWS:g}; give at least {self.end / contract.MAX_ROWS:.2g} [s]"
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
                    f"bearing.surfaces[{index}].rim_stiffness = 0 (surface {index + 1}): this rim exerts no force; "
                    "give a stiffness [N/m], or effects.rims = false"
                )

    def _check_rotation(self) -> None:
        stiff = self.top.rotational_stiffness or self.top.rotational_damping
        if self.top_rotation is not None and not stiff:
            raise InputError(
                f"top_rotation: it acts through rotational springs, and this {self.top.kind} top has none; give it a "
                "rotational_stiffness [N m/rad]"
            )
        if isinstance(self.effects, Effects) and self.effects.top_rotation != (self.top_rotation is not None):
            fact = "the scene has no top_rotation" if self.effects.top_rotation else "the scene has a top_rotation"
            remedy = "give one, or leave the effect out" if self.effects.top_rotation else "set the effect to True"
            raise InputError(f"effects.top_rotation = {self.effects.top_rotation}: {fact}; {remedy}")

    def _check_plane(self) -> None:
        plane, until, name = scene_plane(self)
        if until < self.end:
            where = f"leaves the vertical plane at azimuth {plane:.6g} rad at {until:.6g} s"
            if name == "motion" and until == 0:
                where = "lies in no vertical plane"
            raise InputError(f"effects.dimension = 'planar': the {name} {where}; give effects.dimension = 'spatial'")


_PART_TYPES: dict[str, type | tuple[type, ...]] = {
    "bearing": Bearing,
    "motion": Motion,
    "top": Top,
    "effects": (Effects, Auto),
    "solver": Solver,
    "initial_state": (InitialState, type(None)),
    "stop": (Stop, type(None)),
    "load": (Load, type(None)),
    "top_rotation": (Rotation, type(None)),
    "limits": (Limits, type(None)),
}
