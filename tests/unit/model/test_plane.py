"""Planar stacks in the frame of the user: exact at any azimuth where a run goes on with a spatial model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from reference import kinematics
from support import scene_of

from msfp_gen import Auto, InputError, Load, Motion, Scene, simulate
from msfp_gen.model.plane import tilts_into_plane, tilts_out_of_plane


@pytest.mark.parametrize("azimuth", [0.0, 0.7, -1.1, np.pi / 2])
def test_a_stack_that_leaves_its_plane_keeps_axes_rates_and_directions(azimuth: float) -> None:
    """Against the rotations of PEER 2017/07, at tilts of half a radian."""
    rng = np.random.default_rng(0)
    q, v = np.zeros((4, 3)), np.zeros((4, 3))
    q[:, 1], v[:, 1] = rng.uniform(-0.3, 0.3, 4), rng.uniform(-2.0, 2.0, 4)
    angles, rates, twist = tilts_out_of_plane(q, v, azimuth)
    c, s = np.cos(azimuth), np.sin(azimuth)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    flat, spatial = (kinematics.rotation(kinematics.State(x, y, 0 * x)) for x, y in ((q, v), (angles, rates)))
    assert not angles[:, 2].any() and not rates[:, 2].any()
    for k in range(1, 6):
        axis, speed = flat.t[k][2], np.cross(flat.w[k], flat.t[k][2])
        np.testing.assert_allclose(spatial.t[k][2], turn @ axis, atol=1e-14)
        np.testing.assert_allclose(np.cross(spatial.w[k], spatial.t[k][2]), turn @ speed, atol=1e-13)
        if k < 5:
            pair = spatial.t[k][:2] @ turn @ flat.t[k][0]
            expected = np.cos(azimuth - twist[k - 1]), np.sin(azimuth - twist[k - 1])
            np.testing.assert_allclose(pair, expected, atol=1e-14)


@pytest.mark.parametrize("azimuth", [-4e-16, np.pi / 2 + 2e-16])
def test_an_azimuth_that_is_rounding_is_no_oblique_plane(azimuth: float) -> None:
    """A motion that was turned into E1 has one; with a displaced start it was refused."""
    q = np.zeros((4, 3))
    q[:, 1 if azimuth < 1 else 0] = 0.01
    tilt = tilts_into_plane(q, azimuth, "q")
    assert np.abs(tilt[:, 1]).tolist() == [0.01] * 4 and not tilt[:, [0, 2]].any()
    with pytest.raises(InputError, match="plane only"):
        tilts_into_plane(q, 0.1, "q")


def test_a_run_that_leaves_an_oblique_plane_does_not_shake() -> None:
    """A load across it: the run goes on with a spatial model, whose plates jumped against the springs of the rig."""

    def at(azimuth: float) -> Scene:
        across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        load = Load.from_arrays([0.0, 7.0, 7.5, 8.0], np.outer([0, 0, 1, 0], 500.0 * across))
        motion = Motion.harmonic(0.1, 0.1, cycles=1.0, direction=azimuth)
        return replace(scene_of("fenz-test2", motion=motion, load=load, duration=8.0), effects=Auto(sliders="inertial"))

    aslant, straight = simulate(at(0.7)), simulate(at(0.0))
    assert [note.kind for note in aslant.notes].count("plane") == 1
    for run in (aslant, straight):
        assert run.provenance["model"].count("planar") == 1 and run.provenance["model"].count("spatial") == 1
    assert aslant.extremes.top_force[3] == pytest.approx(straight.extremes.top_force[3], rel=2e-3)
    assert aslant.extremes.most_normal == pytest.approx(straight.extremes.most_normal, rel=1e-3)
    assert aslant.extremes.slip_speed == pytest.approx(straight.extremes.slip_speed, rel=0.05)
