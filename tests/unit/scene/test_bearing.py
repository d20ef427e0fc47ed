import pickle
from dataclasses import replace

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


@pytest.mark.parametrize("name", ["friction", "rim_stiffness", "rim_damping"])
def test_surface_numbers_that_may_be_zero(name):
    assert getattr(replace(SURFACE, **{name: 0}), name) == 0.0
    assert f"surface.{name} = -0.1" in refusal(replace, SURFACE, **{name: -0.1})


def test_one_inertia_stands_for_both():
    assert PLATE.inertia == PLATE.moments == (0.03, 0.03)


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


def test_three_kinds_of_top():
    rig = Top.rig(axial_load=112e3, stiffness=1e8, damping=5, rotational_stiffness=1e6, rotational_damping=5)
    assert rig == RigTop(112e3, 1e8, 5.0, 1e6, 5.0) and rig.kind == "rig"
    load = Top.prescribed(force=[0, 0, -112e3])
    assert load == PrescribedTop((0.0, 0.0, -112e3), (0.0, 0.0, 0.0)) and load.kind == "prescribed"
    mass = Top.mass(mass=1e4, inertia=300, height=0.5)
    assert mass == MassTop(1e4, (300.0, 300.0), 0.5) and mass.kind == "mass"
    for top in (rig, load, mass):
        assert isinstance(top, Top) and pickle.loads(pickle.dumps(top)) == top


def test_angle_tolerance_follows_rtol():
    assert Solver(rtol=1e-6).angle_tolerance == pytest.approx(1e-8)
    assert Solver(rtol=1e-6, atol_angle=1e-5).angle_tolerance == 1e-5
