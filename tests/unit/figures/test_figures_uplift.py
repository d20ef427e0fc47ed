"""Bodies that part are drawn apart, by as much as the run recorded (docs/uplift.md)."""

from __future__ import annotations

import base64
from dataclasses import replace
from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
from support.flights import shaken

from msfp_gen import simulate
from msfp_gen.figures import animate, plot_force_path, plot_section
from msfp_gen.figures.bearing import draw_bars, eccentricity
from msfp_gen.report.frames import STATES, instants, view
from msfp_gen.results.geometry import poses, sections
from msfp_gen.results.sliding import sliding_surfaces

SMOOTH = 1e-3  # friction so small that the footprint of the seat is the slider's face


@cache
def hop():
    """A load on nearly frictionless sliders that lifts off and lands."""
    scene = shaken(1.4, sideways=0.02, duration=0.85)
    return simulate(replace(scene, bearing=scene.bearing.replace(friction=SMOOTH, seat_damping=1.0)))


def highest():
    """The hop with one row, where its top surface is open furthest."""
    history = hop().history
    return hop().at_times(history.time[int(history.lift[:, 3].argmax())])


def test_top_moves_by_the_recorded_displacement_in_flight_too():
    """The compiled model knows nothing of the drawing: r_01 - r_nn less its start."""
    history, top = hop().history, poses(hop()).top[:, -1]
    assert history.lift.max() > 0.01
    assert top[0] - top == pytest.approx(history.displacement, abs=1e-12)


def test_centres_part_by_the_recorded_separation():
    seen, bearing, history = poses(hop()), hop().scene.bearing, hop().history
    for surface, sign in enumerate(bearing.layout.signs):
        arm = sign * bearing.surfaces[surface].radius
        below = seen.top[:, surface] + arm * seen.basis[:, surface, 2]
        above = seen.bottom[:, surface + 1] + arm * seen.basis[:, surface + 1, 2]
        assert above - below == pytest.approx(history.separation[:, surface], abs=1e-12)
        own = above if bearing.slider(surface) == surface + 1 else below
        assert seen.centre[:, surface] == pytest.approx(own, abs=1e-12)


@pytest.mark.parametrize("surface", range(4))
def test_drawn_gap_is_the_recorded_lift(surface):
    """From the face of the slider, as the section draws it, to the sphere of its cup: least over the face.

    The lift is that of the tangent plane (docs/uplift.md): the sphere differs by at most delta^2/(2 R).
    """
    history, bearing = hop().history, hop().scene.bearing
    then = hop().at_times(history.time[int(history.lift[:, surface].argmax())])
    (section,), seen, sign = sections(then, 0.0), poses(then), bearing.layout.signs[surface]
    radius = bearing.surfaces[surface].radius
    if sign > 0:
        cup = seen.top[0, surface] + radius * seen.basis[0, surface, 2]
    else:
        cup = seen.bottom[0, surface + 1] - radius * seen.basis[0, surface + 1, 2]
    gap = radius - np.hypot(*(section.faces[surface] - cup[[0, 2]]).T).max()
    lift, size = then.history.lift[0, surface], np.linalg.norm(then.history.separation[0, surface])
    assert lift > 1e-4 and gap == pytest.approx(lift, abs=0.001 * lift + size**2 / (2 * radius))


def test_section_says_how_far_a_surface_is_open_and_draws_no_force_there(tmp_path):
    then = highest()
    figure = plot_section(then, tmp_path / "section.png")
    axes = figure.axes[0]
    labels = [line.get_label() for line in axes.get_lines()]
    assert f"surface 4 separated by {1e3 * then.history.lift[0, 3]:.2f} mm" in labels
    markers = [line for line in axes.get_lines() if line.get_marker() == "o" and line.get_visible()]
    assert len(markers) == 4 - then.history.separated.sum()
    assert not poses(then).force[0, 3].any()
    plot_force_path(hop(), tmp_path / "path.png")
    assert np.isnan(eccentricity(hop())[hop().history.separated]).all()


def test_bars_are_white_where_a_surface_is_open():
    figure, axes = plt.subplots()
    draw_bars(axes, hop())
    assert "white: separated" in axes.get_title() + axes.get_title(loc="left")
    assert not (sliding_surfaces(hop().history) & hop().history.separated).any()
    plt.close(figure)


def test_movie_of_a_flight_is_written(tmp_path):
    path = animate(hop(), tmp_path / "hop.gif", seconds=0.5, frames_per_second=4)
    assert path.read_bytes().startswith(b"GIF8")


def test_report_says_separated_where_a_surface_is_open():
    seen, when = view(hop()), instants(hop())
    packed = seen["frames"]["state"]
    state = np.frombuffer(base64.b64decode(packed["data"]), "<f4").reshape(packed["shape"])
    flags = hop().at_times(when).history.separated
    assert flags.any() and not flags.all()
    np.testing.assert_array_equal(state == STATES.index("separated"), flags)


def test_characterisation_gives_the_largest_lift_of_a_real_run():
    found, lift = hop().characterise(), hop().history.lift
    assert found.maximum_uplift == lift.max() > 0.01
    assert [use.maximum_uplift for use in found.surfaces] == lift.max(axis=0).tolist()
