"""`BuildingData`: the rows of a building and what follows from them; `BearingResult`: one of its bearings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from msfp_gen.buildings.peaks import Peaks
from msfp_gen.buildings.plausibility import building_doubts
from msfp_gen.buildings.scene import BuildingBearing, BuildingScene, standing_below
from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.dataset import coordinates_of, named_columns
from msfp_gen.results.extremes import Extremes, by_axis, largest
from msfp_gen.results.files import KINDS, ResultFiles, Storage, attributes_of
from msfp_gen.results.history import Event, first_peak
from msfp_gen.results.note import RISING, Note
from msfp_gen.scene.effect_selection import doubtful_values
from msfp_gen.scene.file.loader import bearing_table, plain_table
from msfp_gen.scene.file.toml_text import dumps
from msfp_gen.scene.standing import unsteady

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.analysis.characterise import Characterisation
    from msfp_gen.scene.bearing import Bearing

ENERGY_LIMIT = 0.02  # error of the energy balance of the building over its largest term, above which a note is written
# The variables of the dataset of one bearing that `Result.dataset` has too, and the others with unit and meaning.
RECORDED = ("normal_force", "sliding", "gap", "base_displacement", "displacement", "top_force", "top_moment")
MORE = {
    "axial_force": ("N", "compression between bearing and building"),
    "dissipated": ("J", "energy dissipated in the bearing"),
    "stored": ("J", "energy stored in the bearing and its interface"),
}
GATHERED = ("heat", "law_speed", "law_load", "law_temperature")  # kinds
ENERGY = (
    "the energy balance of the building has an error of {value:.1%} of the largest energy: give a smaller "
    "solver.max_step"
)


@dataclass(frozen=True, eq=False, repr=False)
class BuildingData(ResultFiles):
    """Motion of a building, and forces and sliding of its bearings, at k times. `BuildingResult` adds its summary.

    time: ndarray, shape (k,) [s]. displacement, velocity, acceleration: of the coordinates, shape (k, n), relative to
    the place at rest, in axes that do not move with the ground: accelerations are absolute. ground: displacement,
    velocity and acceleration of the ground, shape (k, 3, 3) [m]. support: of the ground below each bearing, shape
    (k, bearings, 3, 3). wrench: force and moment that the lower and the upper end of each bearing exert on it, shape
    (k, bearings, 2, 6) [N], [N m]. normal_force, sliding: of the surfaces of each bearing, shape (k, bearings, most
    surfaces) [N], [m], NaN where a bearing has no such surface. Energies, shape (k,) or (k, bearings) [J]: dissipated:
    in each bearing; stored: in each bearing, with the springs of its interface; damped: by the damping of the building;
    received: work of the bearings on the building, by their forces beyond those at rest; input: work of the ground.
    counts: of the run. monitored: notes of the monitors of the bearings, each with the number of its bearing.
    recorded_peaks: over all steps; None: not recorded. status: "ok" or the name of a failure; message: one line of
    text, "" for a run that succeeded. provenance: versions with which the result was computed. wall_time [s].
    """

    source: ClassVar[str] = "msfp-gen building"
    scene: BuildingScene
    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    ground: Array
    wrench: Array
    normal_force: Array
    sliding: Array
    dissipated: Array
    stored: Array
    damped: Array
    received: Array
    input: Array
    support: Array
    counts: dict[str, int]
    monitored: tuple[Note, ...] = ()
    recorded_peaks: Peaks | None = None
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    wall_time: float = 0.0

    @cached_property
    def bearings(self) -> tuple[BearingResult, ...]:
        """The result of every bearing."""
        return tuple(BearingResult(self, index) for index in range(len(self.scene.bearings)))

    @cached_property
    def notes(self) -> tuple[Note, ...]:
        """Messages of the monitors in order of time; each names its bearing (docs/buildings.md)."""
        return _notes_of(self)

    @cached_property
    def peaks(self) -> Peaks:
        """Peaks over all steps, or of the rows where the run did not record them."""
        return self.recorded_peaks or peaks_of_rows(self)

    def node(self, name: str) -> Array:
        """Displacement, velocity and acceleration of a node: ndarray, shape (k, 3, 6), [m], [rad] and per s, s^2."""
        rows = self.scene.building.node(name).rows
        return np.stack([values @ rows.T for values in (self.displacement, self.velocity, self.acceleration)], axis=1)

    @property
    def bearing_displacement(self) -> Array:
        """Displacement of the upper end of each bearing relative to the ground, shape (k, bearings, 3) [m]."""
        upper: Array = np.einsum("bin,kn->kbi", self.scene.attachments[:, :3], self.displacement)
        return upper - self.support[:, :, 0]

    @property
    def axial_force(self) -> Array:
        """Compression between the building and each bearing, shape (k, bearings) [N]."""
        return -self.wrench[:, :, 1, 2]

    @property
    def drift(self) -> Array:
        """Deformation of the columns of each storey, along and about E1, E2, E3, shape (k, storeys, 6) [m], [rad]."""
        rows = np.array([column.deformation for column in self.scene.building.columns]).reshape(-1, 6, self._size)
        deformation: Array = np.einsum("sin,kn->ksi", rows, self.displacement)
        return deformation

    @property
    def storey_force(self) -> Array:
        """Force and moment that accelerate the floors above, at half height of each storey, shape (k, storeys, 6).

        [N], [N m]; the first two are the storey shears. Weights are not included.
        """
        rows = np.array([column.inertia for column in self.scene.building.columns]).reshape(-1, 6, self._size)
        force: Array = np.einsum("sin,kn->ksi", rows, self.acceleration)
        return force

    @property
    def base_reaction(self) -> Array:
        """Sum of the forces that the ground exerts on the bearings, shape (k, 3) [N]."""
        forces: Array = self.wrench[:, :, 0, :3].sum(axis=1)
        return forces

    @property
    def base_torsion(self) -> Array:
        """Moment of the forces of the ground about E3 through the centre of mass at rest, shape (k,) [N m]."""
        arms = self.scene.places - self.scene.mass_centre
        forces = self.wrench[:, :, 0]
        moments = arms[:, 0] * forces[..., 1] - arms[:, 1] * forces[..., 0] + forces[..., 5]
        total: Array = moments.sum(axis=1)
        return total

    @property
    def kinetic(self) -> Array:
        """Kinetic energy of the building, shape (k,) [J]."""
        return 0.5 * _squares(self.velocity, self.scene.building.mass)

    @property
    def strain(self) -> Array:
        """Energy of deformation of the building, from the place at rest, shape (k,) [J]."""
        return 0.5 * _squares(self.displacement, self.scene.building.stiffness)

    @property
    def _size(self) -> int:
        return len(self.scene.building.mass)


def peaks_of_rows(result: BuildingData) -> Peaks:
    """Peaks of the rows alone."""
    scene = result.scene
    names = [node.name for node in scene.building.nodes]
    nodes = np.reshape([result.node(name) for name in names], (len(names), len(result.time), 3, 6))
    across = -np.moveaxis(result.bearing_displacement, 1, 0)
    sliding, normal = np.nan_to_num(result.sliding), np.nan_to_num(result.normal_force)
    force, axial = np.moveaxis(result.wrench[:, :, 1, :3], 1, 0), result.axial_force
    base = scene.bearings[0].node
    return Peaks(
        node_acceleration=largest(nodes[:, :, 2, :3]),
        node_displacement=largest(nodes[:, :, 0, :3] - result.ground[:, 0]),
        drift=largest(np.moveaxis(result.drift[..., :3], 1, 0)),
        storey_shear=largest(np.moveaxis(result.storey_force[..., :3], 1, 0)),
        storey_torsion=np.abs(result.storey_force[..., 5]).max(axis=0),
        base_twist=np.abs(result.node(base)[:, 0, 5]).max(keepdims=True),
        mean_displacement=largest(across.mean(axis=0)),
        base_reaction=largest(result.base_reaction),
        base_torsion=np.abs(result.base_torsion).max(keepdims=True),
        energy=np.array([result.kinetic.max(), result.strain.max()]),
        bearing_displacement=largest(across),
        top_force=largest(force),
        axial_force=np.stack([axial.min(axis=0), axial.max(axis=0)], axis=1),
        sliding=sliding.max(axis=0),
        normal_force=np.stack([normal.min(axis=0), normal.max(axis=0)], axis=1),
    )


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    products: Array = ((rows @ matrix) * rows).sum(axis=1)
    return products


@dataclass(frozen=True, eq=False, repr=False)
class BearingResult(ResultFiles):
    """One bearing of a building, at the k times of its result: names and signs are those of `Result` and `History`.

    building: the whole result. index: of the bearing, from 0.
    """

    source: ClassVar[str] = "msfp-gen bearing"
    building: BuildingData
    index: int

    def __repr__(self) -> str:
        """The main results in a few lines."""
        s = self.summary
        return (
            f"B{self.label[1:]}, {s['layout']} at ({s['position'][0]:g}, {s['position'][1]:g}) m\n"
            f"  peak displacement {1e3 * s['peak_displacement']['radial']:.4g} mm, "
            f"force {1e-3 * s['peak_top_force']['radial']:.4g} kN\n"
            f"  N {s['minimum_load_ratio']:.2f} to {s['maximum_load_ratio']:.2f} of that at rest, "
            f"{1e-3 * s['axial_load']:.4g} kN\n"
            f"  peak sliding {', '.join(f'{1e3 * x:.4g}' for x in s['peak_sliding'])} mm, bottom first"
        )

    @property
    def label(self) -> str:
        """What messages call the bearing: its number from 1, and its name."""
        return self.scene.label(self.index)

    @property
    def title(self) -> str:
        """The label, and the name of the building."""
        return f"{self.label} of {self.scene.name or 'an unnamed building'}"

    @property
    def scene(self) -> BuildingScene:
        """That of the building."""
        return self.building.scene

    @property
    def status(self) -> str:
        """How the run ended."""
        return self.building.status

    @property
    def message(self) -> str:
        """One line of text, "" for a run that succeeded."""
        return self.building.message

    @property
    def provenance(self) -> dict[str, str]:
        """Versions with which the result was computed."""
        return self.building.provenance

    @property
    def bearing(self) -> Bearing:
        """Its values."""
        return self.scene.bearings[self.index].bearing

    @property
    def history(self) -> BearingResult:
        """Its rows, by the names of `History`: this view itself."""
        return self

    @property
    def events(self) -> tuple[Event, ...]:
        """None: the run of a building does not record them."""
        return ()

    @property
    def surfaces(self) -> int:
        """Number of surfaces, n - 1."""
        return self.bearing.layout.surfaces

    @property
    def time(self) -> Array:
        """Times, shape (k,) [s]."""
        return self.building.time

    @property
    def base_displacement(self) -> Array:
        """Displacement of the ground below the bearing, shape (k, 3) [m]."""
        moved: Array = self.building.support[:, self.index, 0]
        return moved

    @cached_property
    def displacement(self) -> Array:
        """Displacement across the bearing and its interface, base less top, shape (k, 3) [m]."""
        rows, base = self.scene.attachments[self.index, :3], self.base_displacement
        across: Array = base - self.building.displacement @ rows.T
        across -= across[0]
        return across

    @property
    def horizontal(self) -> Array:
        """Horizontal displacement across the bearing, shape (k,) [m]."""
        return np.hypot(self.displacement[:, 0], self.displacement[:, 1])

    @property
    def peak_row(self) -> int:
        """Row of the largest horizontal displacement; see `first_peak`."""
        return first_peak(self.horizontal)

    @property
    def top_force(self) -> Array:
        """Force of the bearing on the building, shape (k, 3) [N]."""
        force: Array = -self.building.wrench[:, self.index, 1, :3]
        return force

    @property
    def top_moment(self) -> Array:
        """Moment of the bearing on the building about its upper end, shape (k, 3) [N m]."""
        moment: Array = -self.building.wrench[:, self.index, 1, 3:]
        return moment

    @property
    def axial_force(self) -> Array:
        """Compression between bearing and building, shape (k,) [N]."""
        return self.building.axial_force[:, self.index]

    @property
    def axial_load(self) -> float:
        """Compression at rest [N]."""
        return float(self.scene.axial_loads[self.index])

    @property
    def sliding(self) -> Array:
        """Sliding displacements of the surfaces (3.20), shape (k, n-1) [m]."""
        return self.building.sliding[:, self.index, : self.surfaces]

    @property
    def gap(self) -> Array:
        """Gaps to the rims of the surfaces (3.21), capacity less sliding, shape (k, n-1) [m]."""
        gap: Array = self.capacity - self.sliding
        return gap

    @property
    def normal_force(self) -> Array:
        """Normal forces of the surfaces, shape (k, n-1) [N]."""
        return self.building.normal_force[:, self.index, : self.surfaces]

    @property
    def dissipated(self) -> Array:
        """Energy dissipated in the bearing since the start, shape (k,) [J]."""
        return self.building.dissipated[:, self.index]

    @property
    def stored(self) -> Array:
        """Energy stored in the bearing and its interface, shape (k,) [J]."""
        return self.building.stored[:, self.index]

    @property
    def capacity(self) -> Array:
        """Capacities of the surfaces, shape (n-1,) [m]."""
        return np.array([surface.capacity for surface in self.bearing.surfaces])

    @property
    def notes(self) -> tuple[Note, ...]:
        """The notes of its monitors, in order of time."""
        own = (note for note in self.building.monitored if note.bearing == self.index + 1)
        return tuple(sorted(own, key=lambda note: note.time))

    @property
    def model_changes(self) -> tuple[Note, ...]:
        """The notes of its monitors after which it continued with another model; `action` says with which effects."""
        return tuple(note for note in self.notes if note.action)

    @cached_property
    def extremes(self) -> Extremes:
        """Extremes over all steps."""
        peaks, index = self.building.peaks, self.index
        sliding, normal = peaks.sliding[index, : self.surfaces], peaks.normal_force[index, :, : self.surfaces]
        gap = self.capacity - sliding
        return Extremes(peaks.bearing_displacement[index], peaks.top_force[index], sliding, gap, *normal)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results as plain data, SI units; peaks are over all steps, lists for the surfaces, bottom first.

        Keys that `Result.summary` has too: peak_displacement and peak_top_force along E1, E2, E3 and radial [m], [N];
        axial_load at rest [N], and peak_force_ratio over it [-]; peak_sliding and minimum_gap [m]; rims_met (surfaces);
        minimum_normal_force and maximum_normal_force [N]. Others: number (from 1), name, layout, position;
        minimum_load_ratio and maximum_load_ratio: axial force over that at rest [-]; dissipated at the end [J].
        """
        extremes, force = self.extremes, by_axis(self.extremes.top_force)
        ratio = self.building.peaks.axial_force[self.index] / self.axial_load
        return {
            "number": self.index + 1,
            "name": self.scene.bearings[self.index].name,
            "layout": self.bearing.layout.name,
            "position": self.scene.places[self.index].tolist(),
            "peak_displacement": by_axis(extremes.displacement),
            "peak_top_force": force,
            "axial_load": self.axial_load,
            "peak_force_ratio": force["radial"] / self.axial_load,
            "minimum_load_ratio": float(ratio[0]),
            "maximum_load_ratio": float(ratio[1]),
            "peak_sliding": extremes.sliding.tolist(),
            "minimum_gap": extremes.gap.tolist(),
            "rims_met": (np.flatnonzero(extremes.gap <= 0) + 1).tolist(),
            "minimum_normal_force": extremes.least_normal.tolist(),
            "maximum_normal_force": extremes.most_normal.tolist(),
            "dissipated": float(self.dissipated[-1]),
        }

    @classmethod
    def storage(cls) -> Storage:
        """It has none of its own: the file of the building is read."""
        raise InputError(f"this is the result of {KINDS[cls.source]}")

    def derived_and_groups(self) -> tuple[tuple[str, ...], dict[str, xr.Dataset]]:
        """Its file has only the dataset, for other programs."""
        return (), {}

    @cached_property
    def dataset(self) -> xr.Dataset:
        """Its rows as an xarray.Dataset; variables, units and meanings are those of `Result.dataset`."""
        import xarray as xr

        rows = [item for name in RECORDED for item in named_columns(name, getattr(self, name))]
        more = {
            name: (("time",), getattr(self, name), {"units": unit, "long_name": meaning})
            for name, (unit, meaning) in MORE.items()
        }
        one = self.scene.bearings[self.index]
        parts = {"bearing": bearing_table(one.bearing), "interface": plain_table(one.interface)}
        text = dumps({"axial_load": self.axial_load, **parts})
        about = attributes_of(self, "", text, self.notes, {}) | {"bearing": self.label}
        return xr.Dataset(dict(rows) | more, coordinates_of(self.time, self.surfaces), about)

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping and remaining capacity, as `Result.characterise`; N of the period is at rest.

        What the rows of a building do not have (slip velocities) is None, and the notes say so. Raises InputError where
        the bearing did not move.
        """
        from msfp_gen.analysis.characterise.loops import Path
        from msfp_gen.analysis.characterise.report import characterise_rows

        path = Path.of(self.time, self.displacement, self.top_force)
        return characterise_rows(
            self.title, self.status, path, self.bearing, self.axial_load, self.gap, self.dissipated, self.extremes
        )


def _notes_of(result: BuildingData) -> tuple[Note, ...]:
    """The notes of a run in order of time. The text of each begins with the bearing that it is about."""
    scene = result.scene
    values = [
        replace(note, bearing=number)
        for number, (one, load) in enumerate(zip(scene.bearings, scene.axial_loads, strict=True), start=1)
        for note in value_notes(one, load)
    ]
    notes = [*values, *_gathered(result.monitored)]
    labelled = [replace(note, text=f"{scene.label(note.bearing - 1)}: {note.text}") for note in notes]
    whole = [Note(0.0, "value", *doubt) for doubt in building_doubts(scene)]
    return tuple(sorted([*labelled, *whole, *_energy(result)], key=lambda note: note.time))


def _gathered(notes: Sequence[Note]) -> list[Note]:
    """The notes; of those about friction, which many bearings get, one of each kind stands for all.

    It is the one with the largest value of those in `RISING`, and else the first.
    """
    gathered = [note for note in notes if note.kind not in GATHERED]
    for kind in GATHERED:
        alike = [note for note in notes if note.kind == kind and not note.action]
        alike.sort(key=lambda note: -note.value if note.kind in RISING else note.time)
        for note in alike[:1]:
            others = len({other.bearing for other in alike}) - 1
            words = f"; the same holds for {others} other bearing{'s' * (others > 1)}"
            words += ", with less" if kind in RISING else ""
            gathered.append(replace(note, text=note.text + (words if others else "")))
        gathered += [note for note in notes if note.kind == kind and note.action]
    return gathered


def value_notes(one: BuildingBearing, load: float) -> tuple[Note, ...]:
    """Notes about values that are hardly meant, of a bearing and its interface. load: at rest [N]."""
    given, needed, _ = standing_below(one, load)
    doubts = (*doubtful_values(one.bearing), *unsteady("interface.rotational_stiffness", given, needed))
    return tuple(Note(0.0, "value", *doubt) for doubt in doubts)


def _energy(result: BuildingData) -> Iterator[Note]:
    error, row = energy_error(result)
    if error > ENERGY_LIMIT:
        yield Note(float(result.time[row]), "energy", 0, error, ENERGY.format(value=error))


def energy_error(result: BuildingData) -> tuple[float, int]:
    """Largest difference of the work on the building from its energies, over the largest of them, and its row."""
    terms = np.stack([result.received, result.kinetic, result.strain, result.damped])
    difference = np.abs(terms[0] - terms[1:].sum(axis=0))
    row, largest = int(difference.argmax()), float(np.abs(terms).max())
    return (float(difference[row]) / largest if largest else 0.0), row
