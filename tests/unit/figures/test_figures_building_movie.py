"""Movies of buildings: the frame, its bearings and their states at the instants that are shown."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.buildings import MOTION, PLACES, frame, scene
from support.films import drawn_twice

from msfp_gen import Building, BuildingScene, InputError, simulate
from msfp_gen.buildings.figures import MovingFrame
from msfp_gen.buildings.movie import Elevation, building_film
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.figures import animate, movie

TIMES = np.array([0.1, 0.355, 0.6])


def made() -> BuildingScene:
    return scene(frame(), motion=MOTION, duration=0.8, output_step=0.02, name="frame")


@cache
def result() -> BuildingResult:
    return simulate(made())


def test_rows_between_rows():
    shown, time = result().at_times(TIMES), result().time
    assert isinstance(shown, BuildingResult) and np.array_equal(shown.time, TIMES)
    wanted = np.interp(TIMES, time, result().axial_force[:, 2])
    assert shown.axial_force[:, 2] == pytest.approx(wanted) and shown.bearings[3].history.sliding.shape == (3, 4)
    with pytest.raises(InputError, match=r"time = 0\.9 s: the run holds 0 to 0\.8 s"):
        result().at_times([0.1, 0.9])


def test_the_frame_stands_on_its_bearings():
    """Slab and bearings are placed by different ways: rotations of a node, and rows of attachments."""
    shown = MovingFrame(result().at_times(TIMES), 20.0)
    below = shown.points(0, shown.upper_ends)
    assert below == pytest.approx(shown.uppers, abs=1e-12)
    moved = shown.uppers[:, 1] - shown.upper_ends[1]
    u = np.stack(
        [np.interp(TIMES, result().time, column) for column in result().bearings[1].history.displacement.T], axis=1
    )
    assert np.abs(u).max() > 0.01 and moved[:, :2] == pytest.approx(-20.0 * u[:, :2], abs=1e-9)
    assert np.array_equal(shown.lowers - shown.upper_ends, np.broadcast_to([0.0, 0.0, -shown.depth], (3, 4, 3)))
    # Columns end at the floors: their lower end in the first storey is the upper end of the bearing below.
    assert shown.members[:, : len(PLACES), 0] == pytest.approx(shown.uppers, abs=1e-12)


def test_elevations_see_what_is_across_them():
    shown = MovingFrame(result().at_times(TIMES), 20.0)
    along, across = Elevation(shown, 0.0), Elevation(shown, np.pi / 2)
    assert along.uppers[..., 0] == pytest.approx(shown.uppers[..., 0])
    assert across.uppers[..., 0] == pytest.approx(shown.uppers[..., 1])
    assert along.uppers[..., 1] == pytest.approx(across.uppers[..., 1])
    assert along.left < along.floors[..., 0].min() and along.right > along.floors[..., 0].max()


def test_states_of_bearings():
    given = result().at_times(TIMES)
    wrench = given.wrench.copy()
    wrench[1, 2, 1, 2] = -1e-3 * made().axial_loads[2]
    sliding = given.sliding.copy()
    sliding[2, 0, 3] = made().bearings[0].bearing.surfaces[3].capacity + 1e-6
    shown = MovingFrame(replace(given, wrench=wrench, sliding=sliding), 1.0)
    assert np.argwhere(shown.lifted).tolist() == [[1, 2]]
    assert np.argwhere(shown.on_rim).tolist() == [[2, 0]]


def test_a_frame_of_the_movie_is_what_a_complete_drawing_shows():
    shown = building_film(result(), TIMES, None)
    drawn = drawn_twice(shown, movie.WIDE, shown.height)
    assert np.abs(drawn.pictures[0].astype(int) - drawn.pictures[2]).max() > 100
    assert drawn.differs < 2e-3
    assert {artist.axes for artist in drawn.moving} == set(drawn.figure.axes)
    assert "20 times as large" in drawn.figure.subfigs[0].get_suptitle()


def test_a_building_of_matrices_shows_nodes_and_links(tmp_path):
    from PIL import Image

    given = made()
    slab = frame()
    whole = Building.from_matrices(slab.mass, slab.damping, slab.stiffness, nodes={"base": (range(6), (0.0, 0.0, 0.0))})
    found = replace(result(), scene=replace(given, building=whole))
    shown = MovingFrame(found.at_times(TIMES), 5.0)
    assert shown.members.shape == (3, 4, 2, 3)
    assert shown.members[:, :, 1] == pytest.approx(shown.uppers)
    path, told = tmp_path / "m.gif", []
    animate(found, path, seconds=0.5, frames_per_second=6, azimuth=0.3, progress=lambda *at: told.append(at))
    with Image.open(path) as images:
        assert images.n_frames == 3 and images.size[0] == 800 and images.size[1] % 2 == 0
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_bad_times_leave_no_file(tmp_path):
    with pytest.raises(InputError, match=r"time = 9 s: the run holds 0 to 0\.8 s"):
        animate(result(), tmp_path / "m.gif", end=9.0)
    assert not list(tmp_path.iterdir())
