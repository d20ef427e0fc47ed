"""`BearingResult`: what the run of a building gives of one of its bearings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.peaks import named
from msfp_gen.common.arrays import Array
from msfp_gen.results.note import Note

if TYPE_CHECKING:
    from msfp_gen.buildings.data import BuildingData
    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True, eq=False, repr=False)
class BearingResult:
    """One bearing of a building, at the k times of its result. Signs are those of `Result`.

    building: the whole result. index: of the bearing, from 0.
    """

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
        return self.building.scene.label(self.index)

    @property
    def bearing(self) -> Bearing:
        """Its values."""
        return self.building.scene.bearings[self.index].bearing

    @property
    def time(self) -> Array:
        """Times, shape (k,) [s]."""
        return self.building.time

    @cached_property
    def displacement(self) -> Array:
        """Displacement across the bearing and its interface, base less top, shape (k, 3) [m]."""
        rows = self.building.scene.attachments[self.index, :3]
        moved: Array = self.building.support[:, self.index, 0] - self.building.displacement @ rows.T
        across: Array = moved - moved[0]
        return across

    @property
    def model_changes(self) -> tuple[Note, ...]:
        """The notes of its monitors after which it continued with another model; `action` says with which effects."""
        return tuple(note for index, note in self.building.monitored if index == self.index and note.action)

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
        return float(self.building.scene.axial_loads[self.index])

    @property
    def sliding(self) -> Array:
        """Sliding displacements of the surfaces (3.20), shape (k, n-1) [m]."""
        return self.building.sliding[self.index]

    @property
    def normal_force(self) -> Array:
        """Normal forces of the surfaces, shape (k, n-1) [N]."""
        return self.building.normal_force[self.index]

    @property
    def dissipated(self) -> Array:
        """Energy dissipated in the bearing since the start, shape (k,) [J]."""
        return self.building.dissipated[:, self.index]

    @property
    def capacity(self) -> Array:
        """Capacities of the surfaces, shape (n-1,) [m]."""
        return np.array([surface.capacity for surface in self.bearing.surfaces])

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Main results as plain data, SI units; peaks are over all steps, lists for the surfaces, bottom first.

        Keys: number (from 1), name, layout, position; peak_displacement and peak_top_force along E1, E2, E3 and radial
        [m], [N]; axial_load at rest [N], minimum_load_ratio and maximum_load_ratio (of it) [-]; peak_sliding and
        capacity_left [m]; rims_met (surfaces); minimum_normal_force and maximum_normal_force [N]; dissipated at the end
        [J].
        """
        scene, peaks, index = self.building.scene, self.building.peaks, self.index
        surfaces = self.bearing.layout.surfaces
        sliding, normal = peaks.sliding[index, :surfaces], peaks.normal_force[index, :, :surfaces]
        left, ratio = self.capacity - sliding, peaks.axial_force[index] / self.axial_load
        return {
            "number": self.index + 1,
            "name": scene.bearings[self.index].name,
            "layout": self.bearing.layout.name,
            "position": scene.places[self.index].tolist(),
            "peak_displacement": named(peaks.bearing_displacement[index]),
            "peak_top_force": named(peaks.top_force[index]),
            "axial_load": self.axial_load,
            "minimum_load_ratio": float(ratio[0]),
            "maximum_load_ratio": float(ratio[1]),
            "peak_sliding": sliding.tolist(),
            "capacity_left": left.tolist(),
            "rims_met": (np.flatnonzero(left <= 0) + 1).tolist(),
            "minimum_normal_force": normal[0].tolist(),
            "maximum_normal_force": normal[1].tolist(),
            "dissipated": float(self.dissipated[-1]),
        }


def bearings_of(building: BuildingData) -> tuple[BearingResult, ...]:
    """The result of every bearing of a building."""
    return tuple(BearingResult(building, index) for index in range(len(building.scene.bearings)))
