"""The deformed shape of a stack against independent vectors, the compiled model, and the geometry of spheres."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from reference.cases import LAYOUTS, random_case
from reference.kinematics import points as reference_points
from reference.kinematics import rotation
from support import ROOT, bearing_of, preset_run

from msfp_gen.common.errors import InputError
from msfp_gen.results.geometry import (
    Plane,
    azimuth_of,
    body_bases,
    body_positions,
    cut,
    dish_radius,
    outline,
    poses,
    slider_face,
    slider_radius,
)
from msfp_gen.results.sliding import intervals, rims_in_contact, sliding_surfaces
from msfp_gen.scene.file.loader import load_sheet

RUNS = ("fenz-monotonic", "fenz-test5", "becker-circle-125", "unusual-tfp")


@cache
def shaped(name):
    return poses(preset_run(name))


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_stack_stands_where_the_reference_puts_it(layout):
    values, state, _, _ = random_case(layout, 1)
    at = reference_points(values, state, rotation(state)).r
    angles = np.vstack([state.base.angles, state.q])[None]
    bottom, top, centre = (
        x[0] for x in body_positions(bearing_of(values), body_bases(angles), np.zeros((1, layout[0] - 1, 3)))
    )
    for body in range(1, layout[0] + 1):
        before = "01" if body == 1 else f"{body - 1}{body}"
        assert bottom[body - 1] == pytest.approx(at[before] - at["01"], abs=1e-12)
        assert top[body - 1] == pytest.approx(at[f"{body}{body}"] - at["01"], abs=1e-12)
    for surface in range(1, layout[0]):
        assert centre[surface - 1] == pytest.approx(at[f"{surface}c"] - at["01"], abs=1e-12)


def test_sphere_centres_of_parted_bodies_are_those_of_the_sliders():
    """The slider is the body above where a surface is concave up, the one below where it is concave down."""
    layout = (5, 2, 2)
    values, state, _, _ = random_case(layout, 1)
    bearing, rng = bearing_of(values), np.random.default_rng(1)
    basis = body_bases(np.vstack([state.base.angles, state.q])[None])
    bottom, top, centre = body_positions(bearing, basis, 1e-2 * rng.normal(size=(1, 4, 3)))
    for surface, sign in enumerate(bearing.layout.signs):
        body = surface + 1 if sign > 0 else surface
        radius = bearing.surfaces[surface].radius
        face = bottom[0, body] if sign > 0 else top[0, body]
        assert centre[0, surface] == pytest.approx(face + sign * radius * basis[0, body, 2], abs=1e-12)


@pytest.mark.parametrize(("u", "azimuth"), [((0, 0.1), 90), ((-0.1, 0), 0), ((0.1, -0.1), -45), ((0, 0), 0)])
def test_the_section_lies_along_the_largest_displacement(u, azimuth):
    run = preset_run("fenz-test5")
    moved = np.zeros_like(run.history.displacement)
    moved[7, :2] = u
    still = replace(run, history=replace(run.history, displacement=moved))
    assert azimuth_of(still) == pytest.approx(np.radians(azimuth), abs=1e-12)


@pytest.mark.parametrize("name", RUNS)
def test_top_moves_by_the_recorded_displacement(name):
    """u is what the base moved under the top (r_01 - r_nn)."""
    top = shaped(name).top[:, -1]
    assert top[0] - top == pytest.approx(preset_run(name).history.displacement, abs=1e-12)


@pytest.mark.parametrize("name", RUNS)
def test_neighbours_touch_at_the_contact(name):
    """The contact lies on the sphere of the body below and on that of the body above, which are one."""
    seen, bearing = shaped(name), preset_run(name).scene.bearing
    for surface, sign in enumerate(bearing.layout.signs):
        radius = bearing.surfaces[surface].radius
        below = seen.top[:, surface] + sign * radius * seen.basis[:, surface, 2]
        above = seen.bottom[:, surface + 1] + sign * radius * seen.basis[:, surface + 1, 2]
        for centre in (below, above):
            distance = np.linalg.norm(seen.contact[:, surface] - centre, axis=1)
            assert distance == pytest.approx(np.full(len(seen), radius), rel=1e-9)


@pytest.mark.parametrize("name", RUNS)
def test_contact_lies_on_the_face_of_the_slider(name):
    seen, bearing = shaped(name), preset_run(name).scene.bearing
    for surface in range(bearing.layout.surfaces):
        axis = seen.basis[:, bearing.slider(surface), 2]
        arm = seen.contact[:, surface] - seen.centre[:, surface]
        off = np.linalg.norm(arm - np.sum(arm * axis, axis=1, keepdims=True) * axis, axis=1)
        assert off.max() < slider_radius(bearing, surface)


def test_force_line_touches_the_friction_circle():
    """Closed form of docs/model.md: mu |f| R / sqrt(1 + mu^2 |f|^2) from the sphere centre, sliding or stuck."""
    run = preset_run("fenz-test5")
    seen, history, lengths = shaped("fenz-test5"), run.history, run.scene.bearing.arrays()
    distance = np.linalg.norm(seen.line - seen.centre, axis=-1)
    mobilised = lengths["friction"] * np.linalg.norm(history.friction_state, axis=-1)
    circle = lengths["radius"] * mobilised / np.sqrt(1 + mobilised**2)
    free = history.rim_force == 0
    assert free.sum() > 1000 and not free.all()
    assert distance[free] == pytest.approx(circle[free], abs=1e-9)


def test_force_goes_straight_through_a_light_stack():
    """Weights and inertia of the sliders are small against 112 kN: the four lines are one, rims or not."""
    seen = shaped("fenz-test5")
    unit = seen.force / np.linalg.norm(seen.force, axis=-1, keepdims=True)
    off = np.linalg.norm(np.cross(seen.line - seen.line[:, :1], unit[:, :1]), axis=-1)
    assert off.max() < 2e-4  # of lines that run through centres 0.5 m away


def test_rim_point_reaches_the_rim_when_the_gap_closes():
    seen, run = shaped("fenz-monotonic"), preset_run("fenz-monotonic")
    bearing, gap = run.scene.bearing, run.history.gap
    for surface in (0, 3):
        row = int(np.abs(gap[:, surface]).argmin())
        assert abs(gap[row, surface]) < 1e-6
        cup = surface if bearing.layout.signs[surface] > 0 else surface + 1
        arm = seen.rim[row, surface] - seen.centre[row, surface]
        axis = seen.basis[row, cup, 2]
        off = np.linalg.norm(arm - (arm @ axis) * axis)
        assert off == pytest.approx(dish_radius(bearing, surface), abs=2e-5)  # p of table A.1 is rounded to 0.1 mm


@pytest.mark.parametrize("layout", LAYOUTS, ids=str)
def test_outline_has_the_height_and_the_spheres_of_its_data(layout):
    values, _, _, _ = random_case(layout, 1)
    bearing = bearing_of(values)
    for body, height in enumerate(bearing.arrays()["height"]):
        shape = outline(bearing, body)
        assert tuple(shape[0]) == (0, 0) and shape[-1] == pytest.approx((0, height))
        assert (shape[:, 0] >= 0).all()
    for surface, sign in enumerate(bearing.layout.signs):
        face, radius = slider_face(bearing, surface), bearing.surfaces[surface].radius
        near = outline(bearing, bearing.slider(surface))[:, None] - face
        assert np.linalg.norm(near, axis=-1).min(axis=0) == pytest.approx(np.zeros(len(face)), abs=1e-12)
        middle = (0 if sign > 0 else bearing.arrays()["height"][bearing.slider(surface)]) + sign * radius
        assert np.hypot(face[:, 0], face[:, 1] - middle) == pytest.approx(np.full(len(face), radius), rel=1e-9)


def test_rims_of_facing_dishes_stay_apart():
    """Inner dishes of the hospital: R = 406 mm, 356 mm wide, 90 mm apart, so 90 - 2 (406 - sqrt(406^2 - 178^2))."""
    _, _, bearing = load_sheet(ROOT / "examples" / "hospital-design" / "hospital.toml")
    gap = 0.090 - 2 * (0.406 - np.sqrt(0.406**2 - 0.178**2))
    assert gap == pytest.approx(0.0078, abs=1e-5)
    bottoms = np.concatenate([[0.0], np.cumsum(bearing.arrays()["height"])])
    below, above = (outline(bearing, body)[:, 1] + bottoms[body] for body in (1, 3))
    edge = bottoms[2] + 0.045  # middle of the inner slider
    assert below.max() == pytest.approx(edge - gap / 6) and above.min() == pytest.approx(edge + gap / 6)
    outer = [outline(bearing, body)[:, 1] + bottoms[body] for body in (0, 4)]
    assert outer[1].min() - outer[0].max() > 0.1  # room enough: 0.15 of 160 mm each, as without the other dish
    high = outer[0].max() - bottoms[1] - (2.235 - np.sqrt(2.235**2 - 0.61**2))
    assert high == pytest.approx(0.15 * (0.133 - (2.235 - np.sqrt(2.235**2 - 0.254**2)) + 0.0411), rel=1e-3)


def test_cut_of_a_tilted_face_lies_in_the_plane_and_on_its_sphere():
    run = preset_run("becker-circle-125")
    seen, bearing = poses(run.at_times([80.0, 100.0])), run.scene.bearing
    plane = Plane(seen.top[0, 2], 0.3)
    for surface in range(4):
        body = bearing.slider(surface)
        left, right = cut(slider_face(bearing, surface), seen.bottom[0, body], seen.basis[0, body], plane)
        centre, radius = seen.centre[0, surface], bearing.surfaces[surface].radius
        off = (centre - plane.origin) @ plane.normal
        for branch in (left, right):
            distance = np.hypot(*(branch - plane.project(centre)).T)
            assert distance == pytest.approx(np.full(len(branch), np.sqrt(radius**2 - off**2)), rel=1e-9)
        assert (left[:, 0] <= right[:, 0] + 1e-12).all() and len(left)


def test_a_time_outside_the_run_is_refused():
    with pytest.raises(InputError, match=r"time = 99 s: the run holds 0 to .* s; give a time in between"):
        preset_run("fenz-monotonic").at_times(99.0)


def test_between_rows_angles_run_straight():
    run = preset_run("fenz-test5")
    t = run.history.time[100:102]
    middle, ends = poses(run.at_times(t.mean())), poses(run.at_times(t))
    assert middle.top[0, -1] == pytest.approx(ends.top[:, -1].mean(axis=0), abs=1e-6)


def test_surfaces_slide_in_the_stages_of_section_41():
    """(2,3), (1,3), (1,4), (2,4), (2,3), the fourth and fifth with rims 1, then 1 and 4, met."""
    run = preset_run("fenz-monotonic")
    flags, rims, u = sliding_surfaces(run.history), rims_in_contact(run.history), run.history.displacement[:, 0]
    found = run.summary["transitions"]
    edges = [found[key] for key in ("u_star", "u_star_star", "u_dr1", "u_dr4")] + [u[-1]]
    wanted = ({1, 3}, {1, 4}, {2, 4}, {2, 3})
    met = (set(), set(), {1}, {1, 4})
    for low, high, surfaces, touched in zip(edges, edges[1:], wanted, met, strict=False):
        row = int(np.searchsorted(u, (low + high) / 2))
        assert set(np.flatnonzero(flags[row]) + 1) == surfaces
        assert set(np.flatnonzero(rims[row]) + 1) == touched


def test_spans_by_hand():
    time = np.array([0.0, 1.0, 2.0, 4.0])
    assert intervals(time, np.array([True, False, True, True])) == [(0.0, 0.5), (1.5, 2.5)]
    assert intervals(time, np.zeros(4, bool)) == []
