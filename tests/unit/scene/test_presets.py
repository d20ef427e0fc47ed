from math import pi

import numpy as np
import pytest

from msfp_gen import presets
from msfp_gen.common.errors import InputError
from msfp_gen.motions.motion import Motion
from msfp_gen.scene.bearing import Body, Surface
from msfp_gen.scene.file.loader import scene_from_table
from msfp_gen.scene.file.source import load_scene
from msfp_gen.scene.scene_fields import Stop
from msfp_gen.scene.top import Top
from msfp_gen.specification.layout import Layout

RIG = Top.rig(axial_load=112e3, stiffness=1e8, damping=5, rotational_stiffness=1e6, rotational_damping=5)
ORBITS = (125, 88, 50, 25, 12, 5)


def test_catalogue_is_complete_and_described():
    expected = {f"fenz-test{k}" for k in range(1, 6)} | {"fenz-monotonic", "unusual-tfp"}
    expected |= {f"becker-{shape}-{mm}" for shape in ("circle", "eight") for mm in ORBITS}
    expected |= {"ridgecrest-ccc", "ridgecrest-clc"}
    kinds = {"single", "single-articulated", "double", "double-articulated", "quintuple"}
    expected |= {f"{kind}-push" for kind in (*kinds, "triple")}
    assert set(presets.names("scene")) == expected
    assert set(presets.names("building")) == {"hospital-ccc", "hospital-clc"}
    bearings = {"fenz-tfp", "becker-tfp", "prototype-tfp", "building-tfp"} | {f"{kind}-fp" for kind in kinds}
    assert set(presets.names("bearing")) == bearings
    assert presets.names() == presets.names("bearing") | presets.names("scene") | presets.names("building")
    assert all(line and "\n" not in line for line in presets.names().values())


def test_every_scene_loads_under_its_name():
    for name in presets.names("scene"):
        scene = presets.scene(name)
        assert scene.name == name and scene == load_scene(name)


# Tables A.1-A.8, typed here once more from the report: R, s_c, mu; l, z, m, J, r, p.
TABLES = {
    "fenz-tfp": (
        0.013,
        [(0.473, 0.065, 0.03), (0.076, 0.0215, 0.017), (0.076, 0.0215, 0.017), (0.473, 0.065, 0.107)],
        [
            (0.015, 0.0075, 0.45, (3.01e-4, 5.85e-4), 0.051, 0.0028),
            (0.046, 0.023, 0.34, (1.15e-4, 1.11e-4), 0.0255, 0.0044),
            (0.015, 0.0075, 0.45, (3.01e-4, 5.85e-4), 0.051, 0.0028),
            (0.013, 0.0065, 8.0, (3.14e-2, 6.25e-2)),
        ],
    ),
    "becker-tfp": (
        0.011,
        [(0.9906, 0.0918, 0.118), (0.0762, 0.0135, 0.036), (0.0762, 0.0135, 0.036), (0.9906, 0.0918, 0.137)],
        [
            (0.0127, 0.0063, 0.45, (1.69e-4, 3.27e-4), 0.0381, 0.00073),
            (0.0254, 0.0127, 0.34, (4.91e-5, 6.17e-5), 0.0191, 0.0024),
            (0.0127, 0.0063, 0.45, (1.69e-4, 3.27e-4), 0.0381, 0.00073),
            (0.011, 0.0055, 8.0, (3.93e-2, 7.84e-2)),
        ],
    ),
}


@pytest.mark.parametrize("name", TABLES)
def test_bearings_are_those_of_appendix_a(name):
    base, surfaces, bodies = TABLES[name]
    bearing = presets.bearing(name)
    assert (bearing.layout, bearing.base_height, bearing.gravity) == (Layout.tfp(), base, 9.8)
    literal = [Surface(R, s_c, mu, 5e-5 / R, 1e7, 5.0) for R, s_c, mu in surfaces]  # d_y = R_0/R, numbers in SI
    assert list(bearing.surfaces) == literal
    assert list(bearing.bodies) == [Body(*row) for row in bodies]


def test_scenes_of_the_report_have_no_contact_damping_and_scenes_of_ones_own_have():
    """The report has none; a bearing of its tables in another scene has what every surface has."""
    reports = [name for name in presets.names("scene") if name.startswith(("fenz", "becker", "unusual", "triple"))]
    assert len(reports) == 20
    for name in reports:
        assert {surface.contact_damping for surface in presets.scene(name).bearing.surfaces} == {0.0}
    own = scene_from_table(
        {
            "bearing": {"preset": "fenz-tfp", "friction": [0.04, 0.02, 0.02, 0.08]},
            "motion": {"kind": "harmonic", "amplitude": 0.075, "frequency": 0.2},
            "top": {"kind": "rig", "axial_load": 112e3, "stiffness": 1e8},
        }
    )
    assert {surface.contact_damping for surface in own.bearing.surfaces} == {1e-4}


def test_rim_offsets_are_the_sagitta_of_the_convex_face():
    for name in TABLES:
        bearing = presets.bearing(name)
        for surface in (0, 1):
            R, body = bearing.surfaces[surface].radius, bearing.bodies[surface]
            assert body.rim_offset == pytest.approx(R - np.sqrt(R**2 - body.rim_radius**2), rel=0.02)


@pytest.mark.parametrize(
    ("test", "frequency", "amplitude"),
    [(1, 0.10, 0.0012), (2, 0.04, 0.025), (3, 0.013, 0.075), (4, 0.0088, 0.115), (5, 0.0072, 0.140)],
)
def test_unidirectional_tests_are_those_of_table_4_1(test, frequency, amplitude):
    scene = presets.scene(f"fenz-test{test}")
    assert scene.bearing == presets.bearing("fenz-tfp").replace(contact_damping=0.0) and scene.top == RIG
    assert scene.motion == Motion.harmonic(amplitude, frequency)
    assert scene.end == pytest.approx(2.25 / frequency)
    assert scene.motion.displacement(0.25 / frequency) == pytest.approx([amplitude, 0, 0])
    assert np.all(scene.motion.velocity(0.0) == 0)


def test_monotonic_ends_by_itself():
    scene = presets.scene("fenz-monotonic")
    assert scene.motion.displacement(1.5) == pytest.approx([0.05 * 1.5**2, 0, 0])
    assert scene.motion.displacement(scene.end)[0] > 0.140
    assert scene.stop == Stop(displacement=0.140, all_rims=True)
    assert scene.top == RIG


def test_unusual_bearing_differs_in_friction_alone():
    scene = presets.scene("unusual-tfp")
    assert [s.friction for s in scene.bearing.surfaces] == [0.064, 0.168, 0.168, 0.064]
    changed = scene.bearing.replace(friction=[0.03, 0.017, 0.017, 0.107], contact_damping=1e-4)
    assert changed == presets.bearing("fenz-tfp")
    assert scene.motion == Motion.harmonic(0.14, 0.02)


def test_orbits_after_the_lead_in():
    for mm in ORBITS:
        t, A = 20 + np.linspace(0, 4 * pi / 0.1, 50), mm / 1000
        expected = {"circle": np.sin(0.1 * t), "eight": np.sin(0.2 * t)}
        for shape, second in expected.items():
            scene = presets.scene(f"becker-{shape}-{mm}")
            found = scene.motion.displacement(np.minimum(t, scene.end))
            np.testing.assert_allclose(found, A * np.stack([np.cos(0.1 * t), second, 0 * t], -1), atol=1e-6 * A)
            assert scene.bearing == presets.bearing("becker-tfp").replace(contact_damping=0.0) and scene.top == RIG
            assert scene.end == pytest.approx(20 + 4 * pi / 0.1)


@pytest.mark.parametrize("station", ["ccc", "clc"])
def test_earthquakes_shake_all_three_ways(station):
    scene = presets.scene(f"ridgecrest-{station}")
    assert scene.top.kind == "mass" and scene.top.mass * 9.8 == pytest.approx(112e3)
    assert scene.end == pytest.approx(60.0)
    peaks = np.abs(scene.motion.acceleration(np.linspace(0, scene.end, 6001))).max(axis=0) / 9.8
    assert np.all(peaks > 0.3) and np.all(peaks < 0.6)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: presets.scene("fenz-tets2"), "did you mean 'fenz-test2'?"),
        (lambda: presets.bearing("fenz"), "no preset of that name"),
        (lambda: presets.bearing("fenz-test2"), "bearing = 'fenz-test2'"),
        (lambda: presets.names("motions"), "give one of 'bearing', 'scene', 'building'"),
    ],
)
def test_unknown_names_are_refused(call, word):
    with pytest.raises(InputError) as error:
        call()
    assert word in str(error.value)
