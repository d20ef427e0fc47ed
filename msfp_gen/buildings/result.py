"""`BuildingResult`: the result of the run of a building; each of its bearings has a `Result` as a bearing alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.buildings import dataset as building_dataset
from msfp_gen.buildings import summary as summaries
from msfp_gen.buildings.extremes import OF_SURFACES, BuildingExtremes, corners, heated, overturning
from msfp_gen.buildings.notes import notes_of
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.buildings.spectra import FloorSpectra, Steps, floor_spectra, kept_spectra
from msfp_gen.buildings.summary import BuildingCharacterisation
from msfp_gen.common.arrays import Array
from msfp_gen.common.tables import LabelledValues, Table
from msfp_gen.results.files import Storage
from msfp_gen.results.history import ENERGY_BELOW, BearingRows, Extremes, by_axis
from msfp_gen.results.joining import at_times
from msfp_gen.results.note import Note
from msfp_gen.results.result import AnyResult, Curve, Mounting, Result
from msfp_gen.results.summary import ratios_text, time_row
from msfp_gen.scene.fidelity import Backbone


@dataclass(frozen=True, eq=False, repr=False)
class BuildingResult(AnyResult):
    """The result of `simulate` for a building; a RunError has one in `.result` if the run failed after its start.

    It has the motion of the building, and the forces and the sliding of its bearings, at k times.

    Attributes:
        time: ndarray, shape (k,) [s].
        displacement, velocity, acceleration: of the coordinates, relative to the position at rest, in axes that do not
            move with the ground, so that accelerations are absolute, shape (k, n) [SI].
        ground: displacement, velocity and acceleration of the ground, shape (k, 3, 3) [SI].
        support: displacement, velocity and acceleration of the ground below each bearing, shape (k, bearings, 3, 3)
            [SI].
        wrench: force and moment that the lower and the upper end of each bearing exert on it, shape (k, bearings, 2, 6)
            [N, N m].
        normal_force, rim_force: of the surfaces of each bearing, shape (k, bearings, most surfaces) [N]; NaN where a
            bearing has no such surface.
        sliding, lift: sliding and clearance between separated faces, shape (k, bearings, most surfaces) [m].
        temperature: of the surfaces, of the start where a model has none, shape (k, bearings, most surfaces) [degC].
        dissipated: in each bearing, shape (k, bearings) [J].
        interface_dissipated: by the dampers of each interface, shape (k, bearings) [J].
        stored: in each bearing and the springs of its interface, shape (k, bearings) [J].
        damped: by the damping of the building, shape (k,) [J].
        received: work of the bearings on the building, by their forces beyond the loads at rest, shape (k,) [J].
        input: work of the ground, shape (k,) [J].
        steps: accelerations of the nodes at the start and the ends of all steps, whatever the times of the rows.
        counters: work of the solver.
        monitored: notes of the monitors of the bearings, each with the number of its bearing.
        extremes: over all steps.
        status: "ok" or the name of a failure.
        message: one line of text, "" for a run that succeeded.
        provenance: versions with which the result was computed.
        wall_time: of the run [s].
    """

    source: ClassVar[str] = "msfp-gen building"
    storage: ClassVar[Storage] = building_dataset.STORAGE
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
    interface_dissipated: Array
    stored: Array
    damped: Array
    received: Array
    input: Array
    support: Array
    steps: Steps
    counters: dict[str, int]
    extremes: BuildingExtremes
    monitored: tuple[Note, ...] = ()
    status: str = "ok"
    message: str = ""
    provenance: dict[str, str] = field(default_factory=dict)
    wall_time: float = 0.0

    @cached_property
    def bearings(self) -> tuple[Result, ...]:
        """The result of every bearing."""
        return tuple(bearing_result(self, index) for index in range(len(self.scene.bearings)))

    @cached_property
    def notes(self) -> tuple[Note, ...]:
        """Notes in order of time; a note on a bearing begins with its label (docs/buildings.md)."""
        error, row = self.energy_error
        shear = float(self.extremes.base_reaction[3]), float(self.extremes.times["base_reaction"][3])
        return notes_of(self.scene, self.monitored, error, float(self.time[row]), shear)

    def node(self, name: str) -> Array:
        """Displacement, velocity and acceleration of a node: ndarray, shape (k, 3, 6), [m, rad], and per s and s^2."""
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
        return self._of_storeys("deformation", self.displacement)

    @property
    def storey_force(self) -> Array:
        """Force and moment that accelerate the floors above, at half height of each storey, shape (k, storeys, 6).

        [N], [N m]; the first two are the storey shears. Weights are not included.
        """
        return self._of_storeys("inertia", self.acceleration)

    @property
    def corner_drift(self) -> Array:
        """Drift at the corners of the rectangle around the bearings, along E1, E2, E3, shape (k, storeys, 4, 3) [m].

        The corners are counterclockwise from the corner with the least coordinates.
        """
        drift: Array = np.einsum("scin,kn->ksci", corners(self.scene), self.displacement)
        return drift

    @property
    def overturning_moment(self) -> Array:
        """Moment along E1 and E2 that accelerates the building, about its mass centre at height 0, (k, 2) [N m]."""
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
    def potential(self) -> Array:
        """Potential energy of the weights, from the position at rest, shape (k,) [J].

        It is the work against the loads of the bearings at rest, which carry weights and static strains.
        """
        raised = self.displacement @ self.scene.attachments[:, 2].T
        energy: Array = raised @ self.scene.axial_loads
        return energy

    def _of_storeys(self, name: str, motion: Array) -> Array:
        """The rows `name` of the columns of every storey times a motion, shape (k, storeys, 6) [SI]."""
        columns = self.scene.building.columns
        rows = np.array([getattr(column, name) for column in columns]).reshape(-1, 6, motion.shape[1])
        values: Array = np.einsum("sin,kn->ksi", rows, motion)
        return values

    @property
    def work(self) -> Mapping[str, float]:
        """Counters of the work of the solver, and wall_time [s]."""
        return {**self.counters, "wall_time": self.wall_time}

    def at_times(self, times: ArrayLike) -> Self:
        """The result with rows at other times: see `AnyResult.at_times`."""
        changed: Self = at_times(self, times)
        return changed

    @property
    def compared(self) -> dict[str, Array]:
        """Horizontal histories by which runs are compared: quantity -> ndarray, shape (k, places, 2) [SI].

        Displacement of the bearings, base shear, accelerations of the nodes (of floors at their centres of mass), and
        drifts of the storeys at their stiffness centres.
        """
        nodes = [node.rows[:2] for node in self.scene.building.nodes]
        floors = np.einsum("fin,kn->kfi", np.array(nodes), self.acceleration)
        storeys = {"drift": self.drift[:, :, :2]} if self.scene.building.columns else {}
        return {
            "bearing_displacement": self.bearing_displacement[:, :, :2],
            "base_shear": self.base_reaction[:, None, :2],
            "floor_acceleration": floors,
            **storeys,
        }

    @cached_property
    def energy_error(self) -> tuple[float, int]:
        """Largest error of the energy balance over the largest energy [-], and its row.

        The error is the work of the bearings on the building less its kinetic, strain and damped energy.
        """
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
        shear [N]; peak_force_ratio: radial, over the weight [-]; rims_met: numbers (from 1) of bearings in which a
        slider reached its rim; verdict: demands on the bearings against their limits (docs/results.md).

        Other keys:

        - weight [N].
        - peak_base_torsion: about E3 through the centre of mass [N m]. peak_twist: of the base about E3 [rad].
        - peak_overturning_moment: about E1 and E2 through the centre of mass, and radial [N m].
        - minimum_load_ratio, maximum_load_ratio: axial force of any bearing over its load at rest [-].
        - peak_floor_acceleration: of any node, of floors at their centres of mass; peak_corner_acceleration: at the
          corners of the plan on any floor [m/s^2]. peak_drift_ratio: of any storey at its stiffness centre;
          peak_corner_drift_ratio: at the corners of the plan [-].
        - floors: for each node name, height [m], place in plan [m], floor (whether it is the centre of mass of a rigid
          floor), peak_acceleration [m/s^2] and peak_displacement relative to the ground [m] there, and the largest at
          the corners of the plan, peak_corner_acceleration and peak_corner_displacement.
        - storeys: for each storey name, height [m], peak_drift [m] and peak_drift_ratio [-] at the stiffness centre,
          peak_corner_drift [m] and peak_corner_drift_ratio [-] at the corners of the rectangle around the bearings,
          peak_shear [N], peak_torsion [N m].
        - bearings: see `summarise` in `results.summary`.
        - energy: largest kinetic and strain energy of the building; at the end input, the work of the ground, damped by
          the building, dissipated by the bearings and interface_dissipated by their interfaces [J]; closure_error of
          the balance of the building [-].
        """
        return summaries.summarise(self)

    def entry(self, key: str) -> Any:
        """One entry of the summary by its key, or `floor_spectra` for the row of a suite; None where there is none."""
        return kept_spectra(self) if key == "floor_spectra" else super().entry(key)

    @property
    def floors(self) -> list[dict[str, Any]]:
        """Peaks of every node, as in the summary."""
        extremes = self.extremes
        peaks = {
            "peak_acceleration": "node_acceleration",
            "peak_displacement": "node_displacement",
            "peak_corner_acceleration": "corner_acceleration",
            "peak_corner_displacement": "corner_displacement",
        }
        return [
            {
                "name": node.name,
                "height": float(node.position[2]),
                "place": node.position[:2].tolist(),
                "floor": node.floor,
                **{key: by_axis(getattr(extremes, name)[index]) for key, name in peaks.items()},
                "times": {key: by_axis(extremes.times[name][index]) for key, name in peaks.items()},
            }
            for index, node in enumerate(self.scene.building.nodes)
        ]

    def floor_spectra(self, periods: ArrayLike | None = None, damping: float = 0.05) -> FloorSpectra:
        """Spectra of the accelerations of all floors, from the ends of all steps, whatever the times of the rows.

        periods: shape (p,) [s]; None: 120 from 0.03 to 5 s. damping: ratio to the critical damping [-]. Raises
        InputError.
        """
        return floor_spectra(self, periods, damping)

    @property
    def storeys(self) -> list[dict[str, Any]]:
        """Peaks of every storey, as in the summary."""
        nodes, extremes, rows = self.scene.building.nodes, self.extremes, []
        for index, column in enumerate(self.scene.building.columns):
            height = float(nodes[index + 1].position[2] - nodes[index].position[2])
            drifts, corner = by_axis(extremes.drift[index]), by_axis(extremes.corner_drift[index])
            rows.append(
                {
                    "name": column.name,
                    "height": height,
                    "peak_drift": drifts,
                    "peak_drift_ratio": drifts["radial"] / height,
                    "peak_corner_drift": corner,
                    "peak_corner_drift_ratio": corner["radial"] / height,
                    "peak_shear": by_axis(extremes.storey_shear[index]),
                    "peak_torsion": float(extremes.storey_torsion[index]),
                    "times": {
                        "peak_drift": by_axis(extremes.times["drift"][index]),
                        "peak_corner_drift": by_axis(extremes.times["corner_drift"][index]),
                        "peak_shear": by_axis(extremes.times["storey_shear"][index]),
                        "peak_torsion": float(extremes.times["storey_torsion"][index]),
                    },
                }
            )
        return rows

    def main_results(self) -> LabelledValues:
        """Label and value of the main results."""
        s = self.summary
        displacement, force = s["peak_displacement"], s["peak_force"]
        return [
            time_row(s),
            ("bearings", f"{len(self.bearings)}, peak displacement {1e3 * displacement['radial']:.4g} mm"),
            (
                "base shear",
                f"{1e-6 * force['radial']:.4g} MN ({s['peak_force_ratio']:.3f} of the weight) "
                f"at {s['times']['peak_force']['radial']:.4g} s",
            ),
            *summaries.floor_rows(s),
            ("N over N at rest", ratios_text(s)),
            ("rims met", summaries.rims_text(s["bearings"])),
        ]

    @property
    def curve(self) -> Curve:
        """The orbit of the bearing with the largest displacement."""
        bearing = self.bearings[int(self.extremes.bearing_displacement[:, 3].argmax())]
        x, y = bearing.history.displacement[:, :2].T
        return Curve(x, y, f"orbit of {bearing.label}")

    def work_rows(self) -> LabelledValues:
        """Label and value of the energies, the twist and the overturning moment."""
        return summaries.work_rows(self.summary)

    def part_tables(self) -> list[Table]:
        """Tables of the floors, storeys and bearings."""
        return summaries.tables(self.summary)

    def film(self, times: Array, azimuth: float | None) -> Any:
        """The movie of the run; see `figures.movie.film_of`."""
        from msfp_gen.buildings.movie import building_film

        return building_film(self, times, azimuth)

    @property
    def page(self) -> Any:
        """What a report has of the run; see `report.page.page_of`."""
        from msfp_gen.buildings.page import PAGE

        return PAGE

    def characterise(self) -> BuildingCharacterisation:
        """Effective properties of the isolation system, and the demand on every bearing (docs/buildings.md).

        Raises InputError where the bearings did not move.
        """
        return BuildingCharacterisation.of(self)


def _squares(rows: Array, matrix: Array) -> Array:
    """x^T A x of every row x, shape (k,)."""
    products: Array = ((rows @ matrix) * rows).sum(axis=1)
    return products


def bearing_result(building: BuildingResult, index: int) -> Result:
    """The result of a bearing by its index, from 0."""
    scene, bearing = building.scene, building.scene.bearings[index].bearing
    base, wrench = building.support[:, index, 0], building.wrench[:, index, 1]
    across = base - building.displacement @ scene.attachments[index, :3].T  # both start at zero
    own = (slice(None), index, slice(bearing.layout.surfaces))
    rows = {name: getattr(building, name)[own] for name in (*OF_SURFACES, "normal_force")}
    rows["temperature"] = heated(bearing, rows["temperature"])
    history = BearingRows(
        time=building.time,
        base_displacement=base,
        displacement=across,
        top_force=-wrench[:, :3],
        top_moment=-wrench[:, 3:],
        gap=bearing.arrays()["capacity"] - rows["sliding"],
        energy={name: getattr(building, name)[:, index] for name in ENERGY_BELOW},
        **rows,
    )
    own_notes = (note for note in building.monitored if note.bearing == index + 1)
    return Result(
        scene=scene,
        history=history,
        counters=None,
        status=building.status,
        message=building.message,
        provenance=building.provenance,
        notes=tuple(sorted(own_notes, key=lambda note: note.time)),
        recorded_extremes=_extremes(building, index),
        mounting=_mounting(building, index),
    )


def _extremes(building: BuildingResult, index: int) -> Extremes:
    """Extremes of a bearing over all steps, and their times; the gap is least with the largest sliding."""
    bearing = building.scene.bearings[index].bearing
    own = (index, slice(bearing.layout.surfaces))

    def of_bearing(of: Mapping[str, Any]) -> dict[str, Any]:
        least, most = of["normal_force"][index, :, own[1]]
        return {
            "displacement": of["bearing_displacement"][index],
            "top_force": of["top_force"][index],
            "gap": of["sliding"][own],
            "least_normal": least,
            "most_normal": most,
            "rims_met": of["rims_met"][index : index + 1],
            **{name: of[name][own] for name in (*OF_SURFACES, "contact_offset")},
        }

    values, times = of_bearing(vars(building.extremes)), of_bearing(building.extremes.times)
    values["gap"] = bearing.arrays()["capacity"] - values["gap"]
    values["temperature"] = heated(bearing, values["temperature"])
    return Extremes(**values, times=times)


def _mounting(building: BuildingResult, index: int) -> Mounting:
    scene, mount, peaks = building.scene, building.scene.bearings[index], building.extremes
    load, displacement = float(scene.axial_loads[index]), float(peaks.bearing_displacement[index, 3])
    least, most = peaks.axial_force[index] / load
    x, y = scene.places[index].tolist()
    summary = {
        "number": index + 1,
        "name": mount.name,
        "layout": mount.bearing.layout.name,
        "position": [x, y],
        "displacement_used": displacement / Backbone.of(mount.bearing).capacity,
        "minimum_load_ratio": max(float(least), 0.0),  # below 0 its top plate hangs from the building
        "maximum_load_ratio": float(most),
        **{name: float(getattr(building, name)[-1, index]) for name in ("dissipated", "interface_dissipated")},
    }
    return Mounting(
        index + 1,
        scene.label(index),
        mount.bearing,
        scene.modelled[index],
        load,
        mount.interface,
        summary,
        place_row=("bearing", f"{mount.bearing.layout.name} at ({x:g}, {y:g}) m"),
        load_row=("N over N at rest", ratios_text(summary)),
    )
