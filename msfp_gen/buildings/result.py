"""`BuildingResult`: what the run of a building gives; `BearingResult`: one of its bearings."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from msfp_gen.analysis.any_result import AnyResult, Curve, Rows, hysteresis_loop
from msfp_gen.analysis.characterise import Characterisation
from msfp_gen.analysis.summary import peaks_of_bearing, rows_of_bearing, uplift_of
from msfp_gen.analysis.tables import surface_table
from msfp_gen.analysis.verdict import Judged
from msfp_gen.buildings import dataset as building_dataset
from msfp_gen.buildings import summary as summaries
from msfp_gen.buildings.characterise import BuildingCharacterisation, characterise_bearing
from msfp_gen.buildings.extremes import CONTACT, OF_SURFACES, BuildingExtremes, corners, overturning
from msfp_gen.buildings.notes import notes_of
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import Table
from msfp_gen.errors import InputError
from msfp_gen.results.extremes import Extremes
from msfp_gen.results.files import KINDS, Storage
from msfp_gen.results.history import Event, HorizontalMotion
from msfp_gen.results.note import Note

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True, eq=False, repr=False)
class BuildingResult(AnyResult):
    """The result of `simulate` of a building; a RunError has one in `.result` if the run failed after its start.

    Motion of the building, and forces and sliding of its bearings, at k times.

    time: ndarray, shape (k,) [s]. displacement, velocity, acceleration: of the coordinates, shape (k, n), relative to
    the place at rest, in axes that do not move with the ground: accelerations are absolute. ground: displacement,
    velocity and acceleration of the ground, shape (k, 3, 3) [m]. support: of the ground below each bearing, shape (k,
    bearings, 3, 3). wrench: force and moment that the lower and the upper end of each bearing exert on it, shape (k,
    bearings, 2, 6) [N], [N m]. normal_force, sliding, rim_force, lift, the clearance between separated faces, and
    temperature, at the start where a model has none: of the surfaces of each bearing, shape (k, bearings, most
    surfaces) [N], [m], [degC], NaN where a bearing has no such surface. Energies, shape (k,) or (k, bearings) [J]:
    dissipated: in each bearing; stored: in each bearing, with the springs of its interface; damped: by the damping of
    the building; received: work of the bearings on the building, by their forces beyond those at rest; input: work of
    the ground. counters: of the work of the solver. monitored: notes of the monitors of the bearings, each with the
    number of its bearing. recorded_extremes: over all steps; None: not recorded. status: "ok" or the name of a failure;
    message: one line of text, "" for a run that succeeded. provenance: versions with which the result was computed.
    wall_time [s].
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
    rim_force: Array
    lift: Array
    temperature: Array
    dissipated: Array
    stored: Array
    damped: Array
    received: Array
    input: Array
    support: Array
    counters: dict[str, int]
    monitored: tuple[Note, ...] = ()
    recorded_extremes: BuildingExtremes | None = None
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    wall_time: float = 0.0

    @cached_property
    def bearings(self) -> tuple[BearingResult, ...]:
        """The result of every bearing."""
        return tuple(BearingResult.of(self, index) for index in range(len(self.scene.bearings)))

    @cached_property
    def notes(self) -> tuple[Note, ...]:
        """Messages of the monitors in order of time; each names its bearing (docs/buildings.md)."""
        error, row = self.energy_error
        return notes_of(self.scene, self.monitored, error, float(self.time[row]))

    @cached_property
    def extremes(self) -> BuildingExtremes:
        """Extremes over all steps, or of the rows where the run did not record them."""
        return self.recorded_extremes or BuildingExtremes.of_rows(self)

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
    def corner_drift(self) -> Array:
        """Drift at the corners of the rectangle around the bearings, along E1, E2, E3, shape (k, storeys, 4, 3) [m].

        Counterclockwise from that with the least coordinates.
        """
        drift: Array = np.einsum("scin,kn->ksci", corners(self.scene), self.displacement)
        return drift

    @property
    def overturning_moment(self) -> Array:
        """Moment that accelerates the building, about E1 and E2 through its centre of mass at height 0, (k, 2) [N m].

        The bearings provide it, by horizontal forces at their height and by axial forces beyond those at rest.
        """
        moment: Array = self.acceleration @ overturning(self.scene).T
        return moment

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

    @cached_property
    def energy_error(self) -> tuple[float, int]:
        """Largest difference of the work on the building from its energies, over the largest of them, and its row."""
        terms = np.stack([self.received, self.kinetic, self.strain, self.damped])
        difference = np.abs(terms[0] - terms[1:].sum(axis=0))
        row, scale = int(difference.argmax()), float(np.abs(terms).max())
        return (float(difference[row]) / scale if scale else 0.0), row

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results as plain data, ready for JSON; SI units.

        Peaks are over all steps, along E1, E2, E3 and in the plane (`radial`).

        Keys that `Result.summary` has too: name, status, message, notes, duration, counters, wall_time,
        real_time_factor; peak_displacement: across any bearing [m]; peak_force: of the ground on all bearings, the base
        shear [N]; peak_force_ratio: radial, over the weight [-]; rims_met: bearings (from 1) of which a slider reached
        its rim; verdict: what the bearings were asked to bear, against their limits (docs/limits.md).

        Others:

        - weight [N].
        - peak_base_torsion: about E3 through the centre of mass [N m]. peak_twist: of the base about E3 [rad].
        - peak_overturning_moment: about E1 and E2 through the centre of mass, and radial [N m].
        - minimum_load_ratio, maximum_load_ratio: N of any bearing over that at rest [-].
        - peak_floor_acceleration: of any node [m/s^2]. peak_drift_ratio: of any storey;
          peak_corner_drift_ratio: at its corners [-].
        - floors: of each node, name, height [m], peak_acceleration [m/s^2], peak_displacement relative to the ground
          [m].
        - storeys: of each, name, height [m], peak_drift [m] and peak_drift_ratio [-] at the stiffness centre,
          peak_corner_drift [m] and peak_corner_drift_ratio [-] at the corners of the rectangle around the bearings,
          peak_shear [N], peak_torsion [N m].
        - bearings: see `BearingResult.summary`.
        - energy: largest kinetic and strain energy of the building, damped (in it) and dissipated (in the bearings)
          at the end [J]; closure_error of the balance of the building [-].
        """
        return summaries.summarise(self)

    @property
    def floors(self) -> list[dict[str, Any]]:
        """Peaks of every node, as in the summary."""
        return summaries.floor_rows(self.scene.building, self.extremes)

    @property
    def storeys(self) -> list[dict[str, Any]]:
        """Peaks of every storey, as in the summary."""
        return summaries.storey_rows(self.scene.building, self.extremes)

    def main_results(self) -> Rows:
        """Label and value of the main results."""
        s = self.summary
        moved, force, acceleration = s["peak_displacement"], s["peak_force"], s["peak_floor_acceleration"]
        drift = "" if s["peak_drift_ratio"] is None else f", drift {100 * s['peak_drift_ratio']:.3g} % of the height"
        return [
            ("time", f"{self.time[-1]:.6g} s in {self.counters['steps']} steps, {self.wall_time:.3g} s"),
            ("bearings", f"{len(self.bearings)}, peak displacement {1e3 * moved['radial']:.4g} mm"),
            ("base shear", f"{1e-6 * force['radial']:.4g} MN ({s['peak_force_ratio']:.3f} of the weight)"),
            (
                "floors",
                f"peak acceleration {acceleration['radial']:.4g} m/s^2, vertical {acceleration['E3']:.4g}{drift}",
            ),
            ("N over N at rest", f"{s['minimum_load_ratio']:.2f} to {s['maximum_load_ratio']:.2f}"),
            ("rims met", summaries.rims_text(s["bearings"])),
        ]

    def judged(self) -> list[Judged]:
        """All bearings."""
        return [judged for bearing in self.bearings for judged in bearing.judged()]

    @property
    def curve(self) -> Curve:
        """The orbit of the bearing that moves most."""
        most = self.bearings[int(self.extremes.bearing_displacement[:, 3].argmax())]
        x, y = most.displacement[:, :2].T
        return Curve(x, y, f"orbit of {most.label}")

    def tables(self) -> list[Table]:
        """Tables of the run with its floors, storeys and bearings."""
        first, *others = summaries.tables(self.title, self.stated_rows, self.summary)
        return [first, self.verdict.table, *others]

    def characterise(self) -> BuildingCharacterisation:
        """Effective properties of the isolation system, and what is left of every bearing (docs/buildings.md).

        Raises InputError where the bearings did not move.
        """
        return BuildingCharacterisation.of(self)

    @classmethod
    def storage(cls) -> Storage:
        """The functions of `buildings/dataset.py`."""
        return building_dataset


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    products: Array = ((rows @ matrix) * rows).sum(axis=1)
    return products


@dataclass(frozen=True, eq=False, repr=False)
class BearingResult(AnyResult, HorizontalMotion):
    """One bearing of a building, at the k times of its result: names and signs are those of `Result` and `History`.

    building: the whole result, with scene, status, message and provenance. index: of the bearing, from 0; bearing: its
    values. time: shape (k,) [s]. base_displacement: of the ground below the bearing; displacement: across the bearing
    and its interface, base less top, shape (k, 3) [m]. top_force, top_moment: on the building, the moment about the
    upper end of the bearing, shape (k, 3) [N], [N m]. axial_force: compression between bearing and building, shape (k,)
    [N]. sliding (3.20), gap to the rims (3.21), rim_force, normal_force, lift, the clearance between separated faces,
    temperature: of the surfaces, shape (k, n-1) [m], [N], [degC]. dissipated: energy in the bearing since the start;
    stored: in the bearing and its interface, shape (k,) [J].
    """

    source: ClassVar[str] = "msfp-gen bearing"
    building: BuildingResult
    index: int
    scene: BuildingScene
    bearing: Bearing
    status: str
    message: str
    provenance: dict[str, str]
    time: Array
    base_displacement: Array
    displacement: Array
    top_force: Array
    top_moment: Array
    axial_force: Array
    sliding: Array
    gap: Array
    rim_force: Array
    lift: Array
    temperature: Array
    normal_force: Array
    dissipated: Array
    stored: Array

    @classmethod
    def of(cls, building: BuildingResult, index: int) -> BearingResult:
        """A bearing of a building, from 0."""
        scene, bearing = building.scene, building.scene.bearings[index].bearing
        base, wrench = building.support[:, index, 0], building.wrench[:, index, 1]
        across = base - building.displacement @ scene.attachments[index, :3].T
        own = (slice(None), index, slice(bearing.layout.surfaces))
        return cls(
            building=building,
            index=index,
            scene=scene,
            bearing=bearing,
            status=building.status,
            message=building.message,
            provenance=building.provenance,
            time=building.time,
            base_displacement=base,
            displacement=across - across[0],
            top_force=-wrench[:, :3],
            top_moment=-wrench[:, 3:],
            axial_force=building.axial_force[:, index],
            gap=bearing.arrays()["capacity"] - building.sliding[own],
            **{name: getattr(building, name)[own] for name in (*OF_SURFACES, "normal_force")},
            dissipated=building.dissipated[:, index],
            stored=building.stored[:, index],
        )

    @property
    def label(self) -> str:
        """What messages call the bearing: its number from 1, and its name."""
        return self.scene.label(self.index)

    @property
    def title(self) -> str:
        """The label, and the name of the building."""
        return f"{self.label} of {self.building.title}"

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
    def capacity(self) -> Array:
        """Capacities of the surfaces, shape (n-1,) [m]."""
        return self.bearing.arrays()["capacity"]

    @property
    def axial_load(self) -> float:
        """Compression at rest [N]."""
        return float(self.scene.axial_loads[self.index])

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
        peaks, index = self.building.extremes, self.index
        own = (index, slice(self.surfaces))
        least, most = peaks.normal_force[index, :, : self.surfaces]
        return Extremes(
            displacement=peaks.bearing_displacement[index],
            top_force=peaks.top_force[index],
            gap=self.capacity - peaks.sliding[own],
            least_normal=least,
            most_normal=most,
            **{name: getattr(peaks, name)[own] for name in (*OF_SURFACES, *CONTACT)},
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results as plain data, SI units; peaks are over all steps, lists for the surfaces, bottom first.

        Keys that `Result.summary` has too: peak_displacement and peak_force along E1, E2, E3 and radial [m], [N];
        axial_load at rest [N], and peak_force_ratio over it [-]; peak_sliding and minimum_gap [m]; rims_met (surfaces);
        minimum_normal_force and maximum_normal_force, peak_rim_force [N], peak_temperature [degC] where the friction
        heats; uplift: height [m], duration [s] and count; verdict. Others: number (from 1), name, layout, position;
        minimum_load_ratio and maximum_load_ratio: axial force over that at rest [-]; dissipated at the end [J].
        """
        least, most = self.building.extremes.axial_force[self.index] / self.axial_load
        hottest = self.building.extremes.temperature[self.index, : self.surfaces]
        heated = {"peak_temperature": hottest.tolist()} if (hottest > self.temperature[0]).any() else {}
        return {
            "number": self.index + 1,
            "name": self.scene.bearings[self.index].name,
            "layout": self.bearing.layout.name,
            "position": self.scene.places[self.index].tolist(),
            **peaks_of_bearing(self.extremes, self.axial_load),
            "minimum_load_ratio": float(least),
            "maximum_load_ratio": float(most),
            **heated,
            "uplift": uplift_of(self, self.extremes),
            "verdict": self.verdict.as_dict,
            "rims_met": (np.flatnonzero(self.extremes.gap <= 0) + 1).tolist(),
            "dissipated": float(self.dissipated[-1]),
        }

    def main_results(self) -> Rows:
        """Label and value of the main results."""
        s = self.summary
        x, y = s["position"]
        return [
            ("bearing", f"{s['layout']} at ({x:g}, {y:g}) m"),
            *rows_of_bearing(s),
            ("N over N at rest", f"{s['minimum_load_ratio']:.2f} to {s['maximum_load_ratio']:.2f}"),
        ]

    def judged(self) -> list[Judged]:
        """The bearing itself, with its number and its label."""
        return [
            Judged(
                self.index + 1, self.label, self.bearing, self.axial_load, self, self.extremes, self.notes, self.events
            )
        ]

    @property
    def curve(self) -> Curve:
        """The hysteresis loop."""
        return hysteresis_loop(self, self.top_force)

    def tables(self) -> list[Table]:
        """Tables of its main results and of its surfaces."""
        return [
            Table(self.title, (), self.stated_rows),
            surface_table(self.summary, self.bearing.surfaces),
            self.verdict.table,
        ]

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
        return building_dataset.dataset_of_bearing(self)

    def characterise(self) -> Characterisation:
        """Effective stiffness, damping and remaining capacity, as `Result.characterise`; N of the period is at rest.

        What the rows of a building do not have (slip velocities) is None, and the notes say so. Raises InputError where
        the bearing did not move.
        """
        return characterise_bearing(self)
