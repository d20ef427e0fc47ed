"""`RestartState`: what a segment of a run hands over to the next one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.geometry.shape import rim_forces

if TYPE_CHECKING:
    from msfp_gen.model.compiled import Run
    from msfp_gen.model.model import Model
    from msfp_gen.scene.bearing import Bearing


@dataclass(frozen=True, eq=False)
class RestartState:
    """The state in which a segment ended, from which the next one starts with another model.

    time [s]. azimuth: of the frame of the earlier model [rad]. planar: whether it was planar. q, v, f: its angles and
    separations, their rates, and its friction state. foot: height of the foot of the supported mass and its rate, shape
    (2,) [m], [m/s]. force: interface forces, shape (n-1, 3) [N]; rim_force: size of the rim forces, shape (n-1,) [N].
    base_angles: shape (3,) [rad]. origin: displacement across the bearing at the start, shape (3,) [m]. monitor_heat,
    heat: states of the monitor of heat and of the temperature. All but azimuth and planar come from a snapshot.
    """

    time: float
    azimuth: float
    planar: bool
    q: Array
    v: Array
    f: Array
    foot: Array
    force: Array
    rim_force: Array
    base_angles: Array
    origin: Array
    monitor_heat: Array
    heat: Array | None = None

    @classmethod
    def of(cls, model: Model, run: Run, azimuth: float) -> RestartState:
        """The current state of `run`; a row of it is recorded."""
        run.record_now()
        return cls(azimuth=azimuth, planar=model.planar, **model.extension.read_state(run.snapshot(rows=1)))

    def contact_force(self, bearing: Bearing) -> Array:
        """Interface forces without those of the rims, shape (n-1, 3) [N]."""
        angles = np.vstack([self.base_angles, self.q[:, :3]])
        force: Array = self.force - rim_forces(bearing, angles[None], self.rim_force[None])[0]
        return force
