import pickle
from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

from msfp_gen.common.errors import InputError
from msfp_gen.scene.bearing import Bearing, Body, Surface
from msfp_gen.scene.solver import Solver
from msfp_gen.scene.top import MassTop, PrescribedTop, RigTop, Top
from msfp_gen.specification.layout import Layout

SURFACE = Surface(radius=0.5, capacity=0.06, friction=0.03, yield_displacement=1e-4, rim_stiffness=1e7, rim_damping=5.0)
SLIDER = Body(height=0.04, centroid=0.02, mass=1.0, inertia=(1e-3, 1.1e-3), rim_radius=0.05, rim_offset=0.003)
PLATE = Body(height=0.02, centroid=0.012, mass=8.0, inertia=0.03)


def double(**changes):
    values = {"layout": Layout.dfp(), "base_height": 0.01, "surfaces": [SURFACE] * 2, "bodies": [SLIDER, PLATE]}
    return Bearing(**values | changes)


def refusal(make, *args, **kwargs):
    with pytest.raises(InputError) as error:
        make(*args, **kwargs)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_bearing_is_a_frozen_value():
    bearing = double()
    assert bearing == double() and hash(bearing) == hash(double())
    assert pickle.loads(pickle.dumps(bearing)) == bearing
    assert bearing != double(gravity=9.81)
    with pytest.raises(AttributeError):
        bearing.gravity = 1.0


@pytest.mark.parametrize("wrong", [0.0, -1.0, nan, inf, "0.1", True, None])
@pytest.mark.parametrize("name", ["radius", "capacity", "yield_displacement"])
def test_lengths_of_a_surface_are_above_zero(name, wrong):
    assert f"surface.{name} = {wrong!r}" in refusal(replace, SURFACE, **{name: wrong})


@pytest.mark.parametrize("name", ["friction", "rim_stiffness", "rim_damping"])
def test_surface_numbers_that_may_be_zero(name):
    assert getattr(replace(SURFACE, **{name: 0}), name) == 0.0
    assert f"surface.{name} = -0.1" in refusal(replace, SURFACE, **{name: -0.1})


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("height", 0),
        ("mass", 0),
        ("mass", -1),
        ("centroid", -0.001),
        ("centroid", 0.05),
        ("rim_radius", -1),
        ("rim_offset", 0.05),
        ("rim_offset", nan),
        ("inertia", 0),
        ("inertia", (1e-3, 0)),
        ("inertia", (1e-3, nan)),
        ("inertia", (1e-3, 2.1e-3)),
        ("inertia", (1e-3,)),
        ("inertia", "1"),
        ("height", inf),
    ],
)
def test_impossible_bodies_are_refused(name, wrong):
    message = refusal(replace, SLIDER, **{name: wrong})
    assert message.startswith(f"body.{name} = ")


def test_one_inertia_stands_for_both():
    assert PLATE.inertia == PLATE.moments == (0.03, 0.03)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"surfaces": [SURFACE]}, ("bearing.surfaces has 1 entries", "needs 2")),
        ({"bodies": [SLIDER, PLATE, PLATE]}, ("bearing.bodies has 3 entries", "needs 2")),
        ({"surfaces": 3}, ("bearing.surfaces = 3",)),
        ({"surfaces": [SURFACE, SLIDER]}, ("bearing.surfaces[1]", "give a Surface")),
        ({"layout": (3, 1, 1)}, ("bearing.layout", "give a Layout")),
        ({"base_height": -0.01}, ("bearing.base_height = -0.01", "above 0 [m]")),
        ({"gravity": nan}, ("bearing.gravity = nan", "finite")),
        ({"base_centroid": 0.02}, ("bearing.base_centroid = 0.02", "at most")),
        ({"base_rim_offset": 0.02}, ("bearing.base_rim_offset = 0.02", "at most")),
        (
            {"surfaces": [SURFACE, replace(SURFACE, capacity=0.8)]},
            ("bearing.surfaces[1].capacity = 0.8 (surface 2)", "quarter turn"),
        ),
        (
            {"surfaces": [SURFACE, replace(SURFACE, capacity=0.78)]},
            ("bearing.surfaces[1].capacity = 0.78 (surface 2)", "hemisphere"),
        ),
        (
            {"bodies": [replace(SLIDER, rim_radius=0.5), PLATE]},
            ("bearing.bodies[0].rim_radius = 0.5 (body 2)", "radius of the surface"),
        ),
    ],
)
def test_impossible_bearings_are_refused_with_the_reason(changes, words):
    message = refusal(double, **changes)
    assert all(word in message for word in words), message


def test_the_base_slides_where_the_first_surface_is_concave_down():
    single = {"layout": Layout(2, 0, 1), "surfaces": [SURFACE], "bodies": [PLATE]}
    bearing = double(**single, base_rim_radius=0.04)
    assert bearing.slider(0) == 0
    assert bearing.slider_rim_radius(0) == 0.04
    assert "bearing.base_rim_radius = 0.6 (body 1)" in refusal(double, **single, base_rim_radius=0.6)


def test_sliders_follow_the_rims_of_the_report():
    rims = [replace(SLIDER, rim_radius=r) for r in (0.04, 0.02, 0.03)]
    bearing = Bearing(Layout.tfp(), 0.01, [SURFACE] * 4, [*rims, PLATE])
    assert [bearing.slider(i) for i in range(4)] == [1, 2, 2, 3]
    assert [bearing.slider_rim_radius(i) for i in range(4)] == [0.04, 0.02, 0.02, 0.03]  # r_2, r_3, r_3, r_4 (2.109)


def test_arrays_hold_every_number_base_first():
    arrays = double(base_rim_radius=0.03, base_rim_offset=0.002).arrays()
    expected = {
        "radius": [0.5, 0.5],
        "capacity": [0.06, 0.06],
        "friction": [0.03, 0.03],
        "yield_displacement": [1e-4, 1e-4],
        "rim_stiffness": [1e7, 1e7],
        "rim_damping": [5.0, 5.0],
        "seat_damping": [10.0, 10.0],
        "contact_damping": [1e-4, 1e-4],
        "height": [0.01, 0.04, 0.02],
        "centroid": [0.005, 0.02, 0.012],
        "mass": [0.0, 1.0, 8.0],
        "inertia_transverse": [0.0, 1e-3, 0.03],
        "inertia_axial": [0.0, 1.1e-3, 0.03],
        "rim_radius": [0.03, 0.05, 0.0],
        "rim_offset": [0.002, 0.003, 0.0],
        "gravity": 9.8,
    }
    assert arrays.keys() == expected.keys()
    for name, array in arrays.items():
        assert array.dtype == np.float64 and array.flags.c_contiguous
        np.testing.assert_array_equal(array, expected[name], err_msg=name)


def test_replace_by_column_and_by_field():
    columns = {"friction": [0.1, 0.2], "rim_damping": 0.0, "height": [0.05, 0.03], "inertia": (2e-3, 3e-3)}
    bearing = double().replace(**columns, gravity=9.81)
    assert [s.friction for s in bearing.surfaces] == [0.1, 0.2]
    assert [s.rim_damping for s in bearing.surfaces] == [0.0, 0.0]
    assert [b.height for b in bearing.bodies] == [0.05, 0.03]
    assert [b.inertia for b in bearing.bodies] == [(2e-3, 3e-3)] * 2
    assert bearing.gravity == 9.81
    assert double().replace() == double()


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"friction": [0.1]}, "bearing.friction has 1 entries: give 2"),
        ({"frictions": 0.1}, "bearing.frictions: unknown name"),
        ({"friction": -0.1}, "friction = -0.1"),
        ({"surfaces": 3}, "bearing.surfaces = 3"),
        ({"capacity": 1.0}, "quarter turn"),
    ],
)
def test_replace_checks_what_it_is_given(changes, word):
    assert word in refusal(double().replace, **changes)


def test_three_kinds_of_top():
    rig = Top.rig(axial_load=112e3, stiffness=1e8, damping=5, rotational_stiffness=1e6, rotational_damping=5)
    assert rig == RigTop(112e3, 1e8, 5.0, 1e6, 5.0) and rig.kind == "rig"
    load = Top.prescribed(force=[0, 0, -112e3])
    assert load == PrescribedTop((0.0, 0.0, -112e3), (0.0, 0.0, 0.0)) and load.kind == "prescribed"
    mass = Top.mass(mass=1e4, inertia=300, height=0.5)
    assert mass == MassTop(1e4, (300.0, 300.0), 0.5) and mass.kind == "mass"
    for top in (rig, load, mass):
        assert isinstance(top, Top) and pickle.loads(pickle.dumps(top)) == top


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (Top, "top = Top()"),
        (lambda: Top.rig(-1, 1e8), "top.axial_load = -1"),
        (lambda: Top.rig(1e5, -1), "top.stiffness = -1"),
        (lambda: Top.rig(1e5, 1e8, rotational_damping=nan), "top.rotational_damping = nan"),
        (lambda: Top.prescribed((0, 1)), "top.force = (0, 1): give 3 finite numbers [N]"),
        (lambda: Top.prescribed((0, 0, 1), (0, 0, inf)), "top.moment"),
        (lambda: Top.mass(0, 300, 0.5), "top.mass = 0"),
        (lambda: Top.mass(1e4, (300, -1), 0.5), "top.inertia"),
        (lambda: Top.mass(1e4, 300, -0.5), "top.height = -0.5"),
        (lambda: Solver(method="rk4"), "solver.method = 'rk4': give one of 'implicit', 'esdirk4', 'dopri5'"),
        (lambda: Solver(rtol=0), "solver.rtol = 0"),
        (lambda: Solver(rtol=1), "solver.rtol = 1: give a finite number above 0 and below 1"),
        (lambda: Solver(atol_angle=-1), "solver.atol_angle = -1"),
        (lambda: Solver(max_step=0.1, first_step=0.2), "solver.first_step = 0.2"),
        (lambda: Solver(max_steps=0), "solver.max_steps = 0: give a whole number above 0"),
        (lambda: Solver(max_steps=1e3), "solver.max_steps = 1000.0"),
    ],
)
def test_impossible_tops_and_solvers_are_refused(make, word):
    assert word in refusal(make)


def test_angle_tolerance_follows_rtol():
    assert Solver(rtol=1e-6).angle_tolerance == pytest.approx(1e-8)
    assert Solver(rtol=1e-6, atol_angle=1e-5).angle_tolerance == 1e-5
