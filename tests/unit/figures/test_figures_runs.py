"""Figures of one run: what is drawn is what the run recorded, in every figure, and files appear whole or not at all."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest
from support import preset_run
from support.synthetic import loops

from msfp_gen.common.errors import InputError
from msfp_gen.figures import FIGURES, plot_energy, plot_force_path, plot_section, plot_stages
from msfp_gen.figures.bearing import eccentricity
from msfp_gen.figures.section import peak_time
from msfp_gen.figures.style import engineering
from msfp_gen.results.geometry import azimuth_of, friction_circles, sections
from msfp_gen.results.history import ENERGY

PNG = b"\x89PNG"
RUNS = ("fenz-test5", "becker-circle-125", "unusual-tfp")
MILLI = 1e3


@cache
def cut_at(name, time, azimuth=None):
    (section,) = sections(preset_run(name).at_times(time), azimuth)
    return section


def lines_of(axes):
    return {line.get_label(): line for line in axes.get_lines()}


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_written(name, tmp_path):
    path = tmp_path / f"{name}.png"
    FIGURES[name](preset_run("fenz-test5"), path)
    assert path.read_bytes().startswith(PNG)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", FIGURES)
def test_a_wrong_suffix_is_refused(name, tmp_path):
    with pytest.raises(InputError, match=r"plot = .*run\.gif.*: give a name that ends in \.png"):
        FIGURES[name](preset_run("fenz-test5"), tmp_path / "run.gif")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", FIGURES)
def test_a_bearing_that_never_moved_can_be_drawn(name):
    still = loops()
    history = still.history
    nothing = {field: np.zeros_like(getattr(history, field)) for field in ("displacement", "top_force", "sliding")}
    energy = {term: np.zeros_like(history.time) for term in ENERGY}
    history = dataclasses.replace(history, **nothing, energy=energy)
    figure = FIGURES[name](dataclasses.replace(still, history=history, events=()), None)
    figure.draw_without_rendering()
    limits = np.array([[*axes.get_xlim(), *axes.get_ylim()] for axes in figure.axes])
    assert len(limits) and np.isfinite(limits).all()
    assert np.all(limits[:, 0] != limits[:, 1]) and np.all(limits[:, 2] != limits[:, 3])


@pytest.mark.parametrize("run", RUNS)
def test_neighbours_share_the_drawn_face(run):
    """The face of the slider lies on the outline of the cup: on one circle, the sphere cut by the plane."""
    time = peak_time(preset_run(run))
    section, bearing = cut_at(run, time), preset_run(run).scene.bearing
    for surface, face in enumerate(section.faces):
        radius = np.hypot(*(face - section.centres[surface]).T)
        assert radius == pytest.approx(np.full(len(face), radius[0]), rel=1e-9)
        assert 0.9 * bearing.surfaces[surface].radius < radius[0] <= bearing.surfaces[surface].radius * (1 + 1e-12)
        cup = surface if bearing.slider(surface) == surface + 1 else surface + 1
        on = np.abs(np.hypot(*(section.bodies[cup] - section.centres[surface]).T) / radius[0] - 1) < 1e-9
        assert on.sum() > 50


def test_a_planar_section_is_the_meridian():
    section, bearing = cut_at("fenz-test5", 312.5), preset_run("fenz-test5").scene.bearing
    for surface, face in enumerate(section.faces):
        assert np.hypot(*(face - section.centres[surface]).T) == pytest.approx(
            np.full(len(face), bearing.surfaces[surface].radius), rel=1e-9
        )
        contact = section.contacts[surface] - section.centres[surface]
        assert np.hypot(*contact) == pytest.approx(bearing.surfaces[surface].radius, rel=1e-9)


def test_the_top_stands_at_minus_u():
    run = preset_run("fenz-test5")
    section = cut_at("fenz-test5", float(run.history.time[-1]))
    top = section.bodies[-1]
    middle = top[np.abs(top[:, 1] - top[:, 1].max()) < 5e-3, 0].mean()  # the flat face leans a little
    assert middle == pytest.approx(-run.history.displacement[-1, 0], abs=2e-3)


def test_drawn_force_line_touches_the_circle_of_what_slides():
    """About 65 s of test 5 surfaces 1 and 4 slide free of their rims (section 4.1, stage III)."""
    run = preset_run("fenz-test5")
    time = float(run.history.time[np.searchsorted(run.history.time, 65.0)])  # a row: nothing is interpolated
    section, radii = cut_at("fenz-test5", time), friction_circles(run)[0]
    arm = section.centres - section.points
    unit = section.forces / np.hypot(*section.forces.T)[:, None]
    distance = np.abs(arm[:, 0] * unit[:, 1] - arm[:, 1] * unit[:, 0])
    assert distance[[0, 3]] == pytest.approx(radii[[0, 3]], rel=1e-9)
    assert (distance[[1, 2]] < radii[[1, 2]]).all()


def test_section_draws_bodies_faces_contacts_and_line_in_mm():
    figure = plot_section(preset_run("fenz-test5"), time=65.0)
    (axes,), section = figure.get_axes(), cut_at("fenz-test5", 65.0)
    assert len(axes.patches) == 5 and axes.get_aspect() == 1.0
    np.testing.assert_allclose(axes.patches[0].get_xy(), section.bodies[0] * MILLI)
    labels = lines_of(axes)
    assert {"surface 1 slides", "surface 2 sticks", "surface 3 sticks", "surface 4 slides", "line of force"} <= set(
        labels
    )
    np.testing.assert_allclose(labels["surface 4 slides"].get_xydata(), section.faces[3] * MILLI)
    assert labels["surface 4 slides"].get_linewidth() > labels["surface 3 sticks"].get_linewidth()
    contacts = [tuple(line.get_xydata()[0]) for line in axes.get_lines() if line.get_marker() == "o"]
    np.testing.assert_allclose(sorted(contacts), sorted(map(tuple, section.contacts * MILLI)))
    assert "t = 65.000 s" in axes.get_title(loc="left")


def test_friction_circles_are_drawn_on_request():
    from matplotlib.patches import Circle

    run = preset_run("fenz-test5")
    (axes,) = plot_section(run, time=65.0, friction_circles=True).get_axes()
    found = [patch.radius for patch in axes.patches if isinstance(patch, Circle)]
    assert found == pytest.approx(friction_circles(run)[0] * MILLI)


def test_the_plane_follows_the_displacement_or_the_azimuth():
    run = preset_run("becker-circle-125")
    then = run.at_times(90.0)
    assert azimuth_of(then) == pytest.approx(
        np.arctan(then.history.displacement[0, 1] / then.history.displacement[0, 0])
    )
    assert sections(then, 0.5)[0].azimuth == 0.5
    assert -np.pi / 2 < azimuth_of(run.at_times(120.0)) <= np.pi / 2


@pytest.mark.parametrize("draw", [plot_section, plot_force_path])
def test_a_time_outside_the_run_is_refused(draw, tmp_path):
    with pytest.raises(InputError, match=r"time = 999 s: the run holds 0 to 312\.5 s"):
        draw(preset_run("fenz-test5"), tmp_path / "x.png", time=999.0)
    assert not list(tmp_path.iterdir())


def test_stage_bars_stand_where_surfaces_slide():
    run = preset_run("fenz-test5")
    bars = plot_stages(run).get_axes()[1]
    assert [label.get_text() for label in bars.get_yticklabels()] == [f"surface {k}" for k in (1, 2, 3, 4)]
    assert "black" in bars.get_title(loc="left")
    slides = bars.collections[1].get_paths()  # of surface 1, after its pale background
    spans = [path.get_extents() for path in slides]
    assert any(box.x0 < 65.0 < box.x1 for box in spans)
    assert not any(box.x0 < 35.0 < box.x1 for box in spans)  # on its rim


def test_contacts_stay_on_the_sliders():
    off = eccentricity(preset_run("fenz-test5"))
    assert off.shape == preset_run("fenz-test5").history.sliding.shape
    assert (off[-1] > 0).all() and (off.max(axis=0) < [0.051, 0.0255, 0.0255, 0.051]).all()


def test_energy_bands_add_up_to_the_input():
    run = preset_run("fenz-test5")
    axes = plot_energy(run).get_axes()[0]
    top = max(path.vertices[:, 1].max() for band in axes.collections for path in band.get_paths())
    energy = run.history.energy
    assert top == pytest.approx(energy["input"].max() / 1e3, rel=3e-3)  # terms below 0.1 % are left out
    (line,) = axes.get_lines()
    np.testing.assert_allclose(line.get_ydata(), energy["input"] / 1e3)


def test_engineering_prefixes():
    assert engineering([-112e3, 5.0], "N") == (1e-3, "kN")
    assert engineering([0.14], "m") == (1e3, "mm")
    assert engineering([3e6], "J") == (1e-6, "MJ")
    assert engineering([0.0], "N") == (1.0, "N")
    assert engineering([4e-9], "m").unit == "µm"
