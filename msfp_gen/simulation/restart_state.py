"""`RestartState`: what a segment of a run hands over to the next one, and the state of the next model from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.model.compiled import Port, Run, separations_at_rest
from msfp_gen.model.model import Model
from msfp_gen.model.plane import out_of_plane, rotated_pairs, tilts_out_of_plane
from msfp_gen.results.geometry import rim_forces
from msfp_gen.scene.bearing import Bearing
from msfp_gen.scene.standing import seat_stiffness
from msfp_gen.scene.top import Top, sprung_mass
from msfp_gen.specification.friction_laws import Law


@dataclass(frozen=True, eq=False)
class RestartState:
    """The state in which a segment ended, from which the next one starts with another model.

    time [s]. azimuth: of the frame of the earlier model [rad]. planar: whether it was planar. q, v, f: its angles and
    separations, their rates, and its friction state. foot: height of the foot of the supported mass and its rate, shape
    (2,) [m], [m/s]. force: interface forces, shape (n-1, 3) [N]; rim_force: size of the rim forces, shape (n-1,) [N].
    base_angles: shape (3,) [rad]. origin: displacement across the bearing at the start, shape (3,) [m]. monitor_heat:
    parts of the temperature rise that the monitor of heat follows, shape (n-1, 14) [K]. memory: parts of what the
    surfaces remember for the friction law, shape (n-1, parts). All but azimuth and planar come from a snapshot.
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
    memory: Array | None = None

    @classmethod
    def of(cls, model: Model, run: Run, azimuth: float) -> RestartState:
        """The current state of `run`; a row of it is recorded."""
        run.record_now()
        return cls(azimuth=azimuth, planar=model.planar, **model.extension.read_state(run.snapshot(rows=1)))

    @classmethod
    def of_port(cls, port: Port) -> RestartState:
        """The committed state of a two-port, whose ends move in space."""
        return cls(azimuth=0.0, planar=False, **port.state())

    def memory_of(self, law: Law | None) -> Array | None:
        """Parts of what the surfaces remember for a law, shape (n-1, parts) [SI]; None where it needs none.

        A law of temperature takes those of the monitor of heat where the earlier model had no temperatures.
        """
        if law is None or law.memory is None:
            return None
        return self.monitor_heat if self.memory is None and law.depends_on_temperature else self.memory

    def contact_force(self, bearing: Bearing) -> Array:
        """Interface forces without those of the rims, shape (n-1, 3) [N]."""
        angles = np.vstack([self.base_angles, self.q[:, :3]])
        force: Array = self.force - rim_forces(bearing, angles[None], self.rim_force[None])[0]
        return force


def transferred_state(bearing: Bearing, top: Top, model: Model, at: RestartState) -> tuple[Array, Array, Array]:
    """The state q, v, f of the earlier model for the next one (docs/effects.md).

    Shapes (n-1, 3), (n-1, 3), or 6 in place of 3 with separations, and (n-1, 2) [rad], [m], [rad/s], [m/s].

    Angles, rates and friction states describe the same stack. Where the earlier model had no separations, they follow
    from the interface forces without those of the rims: the unilateral contacts are compressed by them.
    """
    q, v, f, force = at.q, at.v, at.f, at.contact_force(bearing)
    separations = (q[:, 3:], v[:, 3:]) if q.shape[1] > 3 else None
    q, v = q[:, :3], v[:, :3]
    if at.planar and not model.planar:
        # Not E1-E3 nor E2-E3, whose tilts are theta or psi alone: to order tilt squared only, plates would jump against
        # stiff springs.
        if min(abs(at.azimuth), abs(at.azimuth - np.pi / 2)) > 1e-9:
            q, v, twist = tilts_out_of_plane(q, v, at.azimuth)
            f = np.concatenate([rotated_pairs(pair[None], t - at.azimuth) for pair, t in zip(f, twist, strict=True)])
        else:
            q, v = (out_of_plane(x, at.azimuth, "angles") for x in (q, v))
            f = out_of_plane(f, at.azimuth, "pair")
        force = out_of_plane(force, at.azimuth, "vector")
        if separations is not None:
            separations = (
                out_of_plane(separations[0], at.azimuth, "vector"),
                out_of_plane(separations[1], at.azimuth, "vector"),
            )
    if model.effects.uplift:
        if separations is None:
            separations = (-force / seat_stiffness(bearing, top)[:, None], np.zeros_like(force))
        q, v = np.hstack([q, separations[0]]), np.hstack([v, separations[1]])
    return np.ascontiguousarray(q), np.ascontiguousarray(v), np.ascontiguousarray(f)


def transferred_heights(
    bearing: Bearing, top: Top, model: Model, at: RestartState, added_load: float = 0.0
) -> tuple[Array, Array]:
    """Origin, shape (3,) [m], and foot, shape (2,) [m], [m/s], of the earlier model for the next: see `RestartState`.

    Separations that the earlier model did not have lower the top plate at rest and change the length of a spring below
    a mass, whose compliance they take over: the next model goes on as if it had been there from the start. added_load:
    that at the start, as of `separations_at_rest`.
    """
    if at.q.shape[1] > 3 or not model.effects.uplift:
        return at.origin, at.foot
    lowered = separations_at_rest(bearing, top, added_load)[:, 2].sum()
    below_mass = sprung_mass(top) * bearing.gravity * (1.0 / seat_stiffness(bearing, top)).sum()
    return at.origin - np.array([0.0, 0.0, lowered]), at.foot + np.array([lowered + below_mass, 0.0])
