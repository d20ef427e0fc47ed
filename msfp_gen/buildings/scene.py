"""`BuildingScene`: the input of a run: a building, its bearings and the motion of the ground.

Loads at rest and vertical modes follow from it; `effects.py` selects the effects of each bearing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np

from msfp_gen.buildings.bearing import BuildingBearing, standing_below
from msfp_gen.buildings.building import Building
from msfp_gen.buildings.effects import EffectRequest, effect_selections
from msfp_gen.buildings.storey import Node
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, prefixed
from msfp_gen.common.fields import Quantity, check_fields, errors_at, require_type
from msfp_gen.common.identity import NO_NUMBERS
from msfp_gen.common.tables import LabelledValues, Printed, Table
from msfp_gen.motions.motion import Motion
from msfp_gen.results.quantities import ColumnSource
from msfp_gen.results.variables import Places
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.effect_selection import EffectSelection
from msfp_gen.scene.effect_switching import with_monitored
from msfp_gen.scene.friction_parameters import bearing_for
from msfp_gen.scene.scene import effects_named
from msfp_gen.scene.scene_fields import Fidelity, Limits
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.standing import check_seats, check_standing
from msfp_gen.scene.system import OtherSystem
from msfp_gen.specification.friction_laws import Law
from msfp_gen.specification.layout import Auto, Effects, ModelSpec

BALANCE = 1e-6  # part of the weight that the bearings do not balance at rest, at most
ROW_STEP = 0.01  # time between rows [s]
APART = 1e-3  # least distance between the axes of two bearings [m]
REST = 1e-9  # largest velocity of the ground at the start [m/s]


class VerticalModes(NamedTuple):
    """The n modes of a building with n coordinates whose bearings resist vertical motion alone.

    squares: of circular frequencies, shape (n,) [1/s^2]. shapes: of unit modal mass, one in each column, shape (n, n)
    [SI]. rates: twice the damping ratio times the circular frequency, shape (n,) [1/s]. shares: strain energy of the
    springs of the interfaces over the strain energy of the mode, shape (n,) [-].
    """

    squares: Array
    shapes: Array
    rates: Array
    shares: Array


@dataclass(frozen=True, eq=False, repr=False)
class BuildingScene(Printed, OtherSystem):
    """The complete input of the run of a building.

    building: the superstructure. bearings: at least one, of any layouts. motion: of the ground, from rest, in
    translation; displacements count from the start. solver: for the common steps of building and bearings. duration:
    of the run [s]; None: of the motion. output_step: time between rows, at which steps end [s]; None: 10 ms. limits: of
    the bearings, for the verdict of the run; None: `Limits()`. fidelity: level of the model, for the notes.
    Raises InputError: inconsistent parts, or weights that the bearings do not balance.
    """

    run_options: ClassVar[frozenset[str]] = frozenset({"threads", "cores"})
    energy_compared: ClassVar[tuple[str, str]] = (
        "the work of the bearings on the building was compared with its kinetic, elastic and damped energy",
        "largest",
    )
    building: Building
    bearings: Sequence[BuildingBearing]
    motion: Motion
    solver: Solver = field(default_factory=Solver)
    duration: Annotated[float | None, Quantity("s", above=0.0)] = None
    name: str = ""
    output_step: Annotated[float | None, Quantity("s", above=0.0)] = None
    limits: Limits | None = field(default=None, metadata=NO_NUMBERS)
    fidelity: Fidelity = field(default="exact", metadata=NO_NUMBERS)

    def __post_init__(self) -> None:
        require_type(self.building, Building, "scene.building")
        require_type(self.motion, Motion, "scene.motion")
        require_type(self.solver, Solver, "scene.solver")
        require_type(self.limits, (Limits, type(None)), "scene.limits")
        object.__setattr__(self, "bearings", tuple(self.bearings))
        for index, mount in enumerate(self.bearings):
            require_type(mount, BuildingBearing, f"scene.bearings[{index}]")
        if not self.bearings:
            raise InputError("scene.bearings: there are none; give at least one BuildingBearing")
        for index, mount in enumerate(self.bearings):
            with errors_at("bearing", f"scene.bearings[{index}].bearing"):
                check_seats(mount.bearing, mount.interface, mount.effects)
        check_fields(self, "scene")
        for index, mount in enumerate(self.bearings):
            if mount.bearing.gravity != self.gravity:
                raise InputError(
                    f"scene.bearings[{index}].bearing.gravity = {mount.bearing.gravity}; the first has "
                    f"{self.gravity}; give all the same [m/s^2]"
                )
        self._check_places()
        self._check_motion()
        if self.solver.method == "dopri5":
            raise InputError("solver.method = 'dopri5': the run of a building is implicit; give 'implicit'")
        for index, (mount, load) in enumerate(zip(self.bearings, self.axial_loads, strict=True)):
            check_standing(f"scene.bearings[{index}].interface.rotational_stiffness", *standing_below(mount, load))

    @property
    def end(self) -> float:
        """Time at which the run ends [s]."""
        return self.motion.duration if self.duration is None else self.duration

    @property
    def row_step(self) -> float:
        """Time between two rows [s]."""
        return ROW_STEP if self.output_step is None else self.output_step

    @cached_property
    def grounds(self) -> tuple[list[Motion], list[int]]:
        """The different motions of the ground, the motion of the scene first, and the index of one for each bearing."""
        motions, indices = [self.motion], []
        for mount in self.bearings:
            own = self.motion if mount.motion is None else mount.motion
            if own not in motions:
                motions.append(own)
            indices.append(motions.index(own))
        return motions, indices

    @property
    def first_ground(self) -> Motion:
        """The motion of the ground below the first bearing."""
        return self.bearings[0].motion or self.motion

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, the same for all bearings [m/s^2]."""
        return self.bearings[0].bearing.gravity

    @property
    def weight(self) -> float:
        """Weight of the building [N]."""
        return -float(self.building.rigid_motions[:, 2] @ self.weights)

    @cached_property
    def mass_centre(self) -> Array:
        """Centre of mass of the building in plan, shape (2,) [m]."""
        motions = self.building.rigid_motions
        inertia = motions.T @ self.building.mass @ motions
        centre: Array = np.array([inertia[1, 5], -inertia[0, 5]]) / inertia[0, 0]
        return centre

    @cached_property
    def places(self) -> Array:
        """Places of the bearings in plan, shape (bearings, 2) [m]."""
        nodes = [self._node(index).position[:2] for index in range(len(self.bearings))]
        pairs = zip(self.bearings, nodes, strict=True)
        return np.array([node if mount.position is None else mount.position for mount, node in pairs], dtype=float)

    def label(self, index: int) -> str:
        """The name of a bearing in messages. index: from 0."""
        name = self.bearings[index].name
        return f"bearing {index + 1}" + (f" ({name})" if name else "")

    @cached_property
    def attachments(self) -> Array:
        """Rows of the upper ends of the bearings, each as `Node.rows`, shape (bearings, 6, n) [SI]."""
        nodes = [self._node(index) for index in range(len(self.bearings))]
        return np.stack(
            [
                node.rows if mount.position is None else node.linked([*mount.position, node.position[2]])
                for node, mount in zip(nodes, self.bearings, strict=True)
            ]
        )

    @cached_property
    def weights(self) -> Array:
        """Forces of gravity on the coordinates of the building, shape (n,) [SI]."""
        return self.building.uniform_acceleration([0.0, 0.0, -self.gravity])

    @cached_property
    def axial_loads(self) -> Array:
        """Compression of the bearings at rest, on the vertical springs of their interfaces, shape (bearings,) [N].

        Raises InputError: the weights are not balanced, or a bearing would be in tension.
        """
        rows = self.attachments[:, 2]
        springs = np.array([mount.interface.vertical_stiffness for mount in self.bearings])
        stiffness = self.building.stiffness + rows.T * springs @ rows
        # No spring resists horizontal motions: the smallest solution is taken. Rounding is relative to each coordinate.
        scale = 1 / np.sqrt(np.maximum(np.diag(stiffness), 1e-9 * np.diag(stiffness).max()))
        scaled = scale[:, None] * stiffness * scale
        if not (np.isfinite(scaled).all() and np.isfinite(scale * self.weights).all()):
            raise InputError(
                "scene.building: stiffness and weights give no finite loads of the bearings; give smaller ones"
            )
        at_rest = scale * np.linalg.lstsq(scaled, scale * self.weights, rcond=1e-12)[0]
        loads: Array = -springs * (rows @ at_rest)
        motions = self.building.rigid_motions
        unbalanced = motions.T @ (self.weights + rows.T @ loads)
        weight = float(np.abs(motions[:, 2] @ self.weights))
        arms = np.array([1.0, 1.0, 1.0, *3 * [max(1.0, float(np.abs(rows @ motions[:, 3:]).max()))]])
        if np.any(np.abs(unbalanced) > BALANCE * weight * arms):
            raise InputError(
                "scene.bearings: vertical forces at their positions do not balance the weight of the building about "
                f"E1 and E2 ({unbalanced[3]:.4g}, {unbalanced[4]:.4g} N m are left); place them around the centre of "
                "mass"
            )
        for index, load in enumerate(loads):
            if load <= 0:
                raise InputError(f"scene.bearings[{index}].position: {self._tension(float(load))}; move it [m]")
        return loads

    @cached_property
    def vertical_modes(self) -> VerticalModes:
        """Modes of the building on the vertical springs and dampers of its interfaces."""
        from scipy.linalg import eigh

        building, rows = self.building, self.attachments[:, 2]
        springs, dampers = (
            rows.T * [getattr(mount.interface, name) for mount in self.bearings] @ rows
            for name in ("vertical_stiffness", "vertical_damping")
        )
        squares, shapes = eigh(building.stiffness + springs, building.mass)
        rates, stored = (
            np.einsum("im,ij,jm->m", shapes, matrix, shapes) for matrix in (building.damping + dampers, springs)
        )
        squares = np.maximum(squares, 0.0)
        return VerticalModes(squares, shapes, rates, stored / np.maximum(squares, 1e-9 * squares.max()))

    @cached_property
    def effect_selections(self) -> tuple[EffectSelection, ...]:
        """The effects of every bearing, with the reason for each that is selected. Raises InputError."""
        return effect_selections(self)

    @property
    def modelled(self) -> tuple[Effects, ...]:
        """The effects of the model of every bearing: as given, or selected from the scene."""
        return tuple(selection.effects for selection in self.effect_selections)

    @property
    def every_bearing(self) -> tuple[Bearing, ...]:
        """The values of all bearings, in the order of the bearings."""
        return tuple(mount.bearing for mount in self.bearings)

    @property
    def own_motions(self) -> tuple[str, ...]:
        """Paths of the motions that bearings have beside the motion of the ground."""
        own = (index for index, mount in enumerate(self.bearings) if mount.motion is not None)
        return tuple(f"building.bearing[{index}].motion" for index in own)

    @property
    def every_spec(self) -> tuple[ModelSpec, ...]:
        """Layout and effects of the model of every bearing at the start."""
        pairs = zip(self.bearings, self.modelled, strict=True)
        return tuple(ModelSpec(mount.bearing.layout, replace(effects, top_rotation=True)) for mount, effects in pairs)

    @property
    def specs(self) -> tuple[ModelSpec, ...]:
        """Layouts and effects of the models of the bearings, each once."""
        return tuple(dict.fromkeys(self.every_spec))

    def start(self, **options: Any) -> Any:
        """The run before its first step; see `simulation.system.start`."""
        from msfp_gen.buildings.run import start_building_run

        return start_building_run(self, **options)

    def text(self) -> str:
        """The scene as text; see `scene.file.loader.scene_text`."""
        from msfp_gen.buildings.dataset import scene_text

        return scene_text(self) + f"[motion]\nname = {self.motion.name!r}\nduration = {self.motion.duration}\n"

    def explain(self) -> list[Table]:
        """Tables that describe the scene; see `scene.explain.explain`."""
        from msfp_gen.buildings.explain import explain

        return explain(self)

    @property
    def figures(self) -> Mapping[str, Any]:
        """The figures of a run by their names; see `figures.figures_of`."""
        from msfp_gen.buildings.figures import FIGURES

        return FIGURES

    def structure(self, table: Mapping[str, Any]) -> Any:
        """What a report shows of the superstructure; see `report.analysis.structure_of`."""
        from msfp_gen.buildings.modes import structure

        return structure(self, table)

    @property
    def comparisons(self) -> Sequence[Any]:
        """What superstructures were compared with; see `report.compared.comparisons_of`."""
        from msfp_gen.buildings.page import COMPARISONS

        return COMPARISONS

    def quantities(self) -> dict[str, ColumnSource]:
        """What tables report of a run; see `results.quantities.quantities`."""
        from msfp_gen.buildings.quantities import quantities

        return quantities(self)

    def printed_rows(self) -> tuple[str, LabelledValues]:
        """The parts in a few rows."""
        layouts = ", ".join(dict.fromkeys(bearing.layout.name for bearing in self.every_bearing))
        parts = {
            "building": f"{len(self.building.mass)} coordinates, {len(self.building.nodes)} nodes, "
            f"{self.weight * 1e-6:.4g} MN",
            "bearings": f"{len(self.bearings)}, (n, m, p) = {layouts}",
            "motion": f"{self.motion.name or 'unnamed'}, {self.motion.duration:g} s",
            "solver": f"{self.solver.method}, rtol {self.solver.rtol:g}, until {self.end:.6g} s",
        }
        return f"BuildingScene {self.name or 'without a name'}", list(parts.items())

    def refusals(self) -> list[str]:
        """Why values can hardly be meant; see `scene.plausibility.refusals`."""
        from msfp_gen.buildings.notes import refusals

        return refusals(self)

    def doubts(self) -> list[str]:
        """What is hardly meant, also what is not refused; see `scene.plausibility.doubts`."""
        from msfp_gen.buildings.notes import doubt_notes

        return [note.text for note in doubt_notes(self)]

    def columns(self) -> Places:
        """The columns of a table of all rows; see `results.dataset.columns`."""
        from msfp_gen.buildings.dataset import columns

        return columns(self)

    def with_bearings(self, change: Callable[[Bearing, Law | None], Bearing]) -> Self:
        """The scene with every bearing changed; a message of `change` begins with the label of the bearing."""
        bearings = []
        for index, mount in enumerate(self.bearings):
            with prefixed(f"{self.label(index)}: "):
                bearings.append(replace(mount, bearing=change(mount.bearing, mount.law)))
        return replace(self, bearings=bearings)

    @property
    def every_effects(self) -> tuple[Effects, ...]:
        """The effects of the model of every bearing at the start."""
        return self.modelled

    def with_effects(self, **changes: Any) -> Self:
        """The scene with other values of `Effects` for every bearing, without numbers of laws that are then unused."""
        bearings = [
            replace(
                mount,
                effects=replace(mount.effects or Auto(), **changes),
                bearing=bearing_for(mount.bearing, changes.get("friction")),
            )
            for mount in self.bearings
        ]
        return replace(self, bearings=bearings)

    def with_all_effects(self) -> Self:
        """The scene with every effect that monitors may add; bearings whose effects are given stay as they are."""
        bearings = []
        for mount, effects in zip(self.bearings, self.modelled, strict=True):
            requested = EffectRequest(Auto() if mount.effects is None else mount.effects, self.solver, self.end)
            bearings.append(replace(mount, effects=with_monitored(requested, effects)))
        return (
            self
            if all(isinstance(mount.effects, Effects) for mount in self.bearings)
            else replace(self, bearings=bearings)
        )

    @property
    def loads_at_rest(self) -> tuple[float, ...]:
        """Axial load of every bearing at rest [N]."""
        return tuple(self.axial_loads.tolist())

    def beginning_like(self, others: Sequence[Self]) -> Self:
        """The scene with uplift from the start in the bearings that have it in any of `others`."""
        uplift = np.any([[effects.uplift for effects in other.modelled] for other in others], axis=0)
        bearings = [
            replace(mount, effects=replace(mount.effects or Auto(), uplift=True))
            if flagged and not effects.uplift
            else mount
            for mount, flagged, effects in zip(self.bearings, uplift, self.modelled, strict=True)
        ]
        return self if bearings == list(self.bearings) else replace(self, bearings=bearings)

    def with_effects_of(self, models: Sequence[str]) -> Self | None:
        """The scene with every effect of several models, by their names, in each bearing that leaves it to monitors.

        None where the models are the same. All bearings take what one needs, so that none adds it on the way.
        """
        if len(set(models)) < 2:
            return None
        named, bearings = effects_named(models), []
        for mount, effects, most in zip(self.bearings, self.modelled, self.with_all_effects().modelled, strict=True):
            added = {
                name: value for name, value in named.items() if getattr(effects, name) != value == getattr(most, name)
            }
            bearings.append(replace(mount, effects=replace(mount.effects or Auto(), **added)) if added else mount)
        return None if bearings == list(self.bearings) else replace(self, bearings=bearings)

    def at_fidelity(self, word: str) -> Any:
        """The scene at a level of fidelity; see `scene.fidelity.at_fidelity`."""
        from msfp_gen.buildings.fidelity import at_fidelity

        return at_fidelity(self, word)

    def _node(self, index: int) -> Node:
        """The node to which a bearing is attached. Raises InputError: unknown node, or a node that carries none."""
        name = self.bearings[index].node
        with prefixed(f"scene.bearings[{index}]."):
            node = self.building.node(name)
        if not node.carries:
            raise InputError(f"scene.bearings[{index}].node = {name!r}: no bearing can be attached there")
        return node

    def _tension(self, load: float) -> str:
        """Why a bearing carries no compression at rest, for a message. load: at rest [N]."""
        centre, low, high = self.mass_centre, self.places.min(axis=0), self.places.max(axis=0)
        where = f"the centre of mass of the building at ({centre[0]:.3g}, {centre[1]:.3g}) m"
        if np.any(centre < low) or np.any(centre > high):
            ranges = f"{low[0]:.3g} to {high[0]:.3g} m along E1 and {low[1]:.3g} to {high[1]:.3g} m along E2"
            return f"it would be in tension at rest ({load:.4g} N): {where} is outside the bearings, {ranges}"
        return f"it would be in tension at rest ({load:.4g} N), where a bearing cannot pull: {where} loads the others"

    def _check_places(self) -> None:
        """Raise InputError where two bearings have the same place or the same name."""
        places = np.column_stack([self.places, [self._node(i).position[2] for i in range(len(self.bearings))]])
        named: dict[str, int] = {}
        for second, bearing in enumerate(self.bearings):
            first = named.setdefault(bearing.name, second)
            if bearing.name and first < second:
                raise InputError(
                    f"scene.bearings[{second}].name = {bearing.name!r}: scene.bearings[{first}] has it; give another"
                )
            (near,) = np.nonzero(np.linalg.norm(places[:second] - places[second], axis=1) < APART)
            if near.size:
                at = ", ".join(f"{x:g}" for x in places[second][:2])
                raise InputError(
                    f"scene.bearings[{second}].position = ({at}): scene.bearings[{near[0]}] is there too; give places "
                    "apart [m]"
                )

    def _check_motion(self) -> None:
        """Raise InputError where a motion rotates, does not start from rest, or ends before the run."""
        own = {f"scene.bearings[{i}].motion": mount.motion for i, mount in enumerate(self.bearings) if mount.motion}
        for name, motion in {"scene.motion": self.motion, **own}.items():
            if np.any(motion.coefficients[:, 3:]):
                raise InputError(f"{name}: the ground rotates; a building takes translations, leave the rotation out")
            speed = float(np.abs(motion.velocity(0.0)).max())
            if speed > REST:
                raise InputError(f"{name}: it starts with {speed:.3g} m/s; give a motion that starts from rest")
            if self.end > motion.duration * (1 + 1e-12):
                field = f"scene.duration = {self.duration}: the motion" if motion is self.motion else f"{name}: it"
                raise InputError(
                    f"{field} lasts {motion.duration:.12g} s, the run {self.end:.12g} s; give at most that as "
                    "scene.duration, or motion.held(...)"
                )
