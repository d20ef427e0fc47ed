"""A bearing by its data sheet: published devices, what follows from a sheet, bad sheets, its place in scene files."""

from __future__ import annotations

from dataclasses import replace
from math import asin, pi, sqrt
from typing import Any

import numpy as np
import pytest

from msfp_gen import Bearing, InputError, load_scene, presets
from msfp_gen.design.effective import characteristic, effective, published_backbone, regimes
from msfp_gen.design.equivalent import DAMPING, equivalent
from msfp_gen.results.geometry import outline
from msfp_gen.scene.fidelity import Backbone
from msfp_gen.scene.file.loader import bearing_from_table, complete_bearing, scene_from_table
from msfp_gen.scene.sheet import Sheet, revolved
from msfp_gen.studies.bounding import SHEET, bounded_scenes, factors_of
from msfp_gen.studies.bounding.runs import _lambdas

# Tables A.1 to A.8 of PEER 2017/07; heights are sums of its l, diameters twice its r.
APPENDIX: dict[str, dict[str, Any]] = {
    "fenz-tfp": {
        "radius": [0.473, 0.076],
        "height": [0.038, 0.023],
        "friction": [0.03, 0.017, 0.017, 0.107],
        "slider_diameter": [0.102, 0.051],
        "capacity": [0.065, 0.0215],
        "plate_height": 0.013,
        "axial_load": 112e3,
    },
    "becker-tfp": {
        "radius": [0.9906, 0.0762],
        "height": [0.0254, 0.0127],
        "friction": [0.118, 0.036, 0.036, 0.137],
        "slider_diameter": [0.0762, 0.0382],
        "capacity": [0.0918, 0.0135],
        "plate_height": 0.011,
        "axial_load": 112e3,
    },
}
FENZ = {"device": "triple", **APPENDIX["fenz-tfp"]}
BOUNDED = {**FENZ, "friction_lower": [0.02, 0.01, 0.01, 0.08], "friction_upper": [0.04, 0.02, 0.02, 0.13]}
SINGLE = {
    "device": "single", "radius": [2.2], "height": [0.0], "friction": [0.06], "slider_diameter": [0.24],
    "dish_diameter": [1.0], "axial_load": 2e6,
}  # fmt: skip
DOUBLE = {
    "device": "double", "radius": [2.2], "height": [0.1], "friction": [0.04, 0.08], "slider_diameter": [0.24],
    "capacity": [0.2], "axial_load": 2e6,
}  # fmt: skip
QUINTUPLE = {
    "device": "quintuple", "radius": [2.2, 1.0, 0.3], "height": [0.16, 0.10, 0.05],
    "friction": [0.09, 0.04, 0.02, 0.02, 0.06, 0.12], "slider_diameter": [0.58, 0.26, 0.16],
    "capacity": [0.22, 0.15, 0.045], "axial_load": 2e6,
}  # fmt: skip


@pytest.mark.parametrize("name", APPENDIX)
def test_appendix_of_the_report_follows_from_a_sheet(name: str) -> None:
    """Heights, radii and capacities are those of the preset; the edges of sliders agree with its printed digits."""
    made, given = Bearing.from_sheet(device="triple", **APPENDIX[name]), presets.bearing(name)
    for field in ("radius", "capacity", "height", "centroid"):
        if field != "centroid":
            np.testing.assert_allclose(made.arrays()[field], given.arrays()[field], rtol=1e-12)
    np.testing.assert_allclose(made.arrays()["rim_radius"], given.arrays()["rim_radius"], atol=1e-12)
    np.testing.assert_allclose(made.arrays()["rim_offset"], given.arrays()["rim_offset"], atol=5e-5)
    assert made.friction_at_pivot == pytest.approx(APPENDIX[name]["friction"])


def test_arc_of_the_dish_is_the_capacity_of_the_report() -> None:
    """Dishes of 9 and 3.5 inches round to the capacities of Table A.1; the report does not print their diameters."""
    sheet = Sheet(**{**FENZ, "capacity": None, "dish_diameter": [0.229, 0.089]})
    assert sheet.capacity is not None and np.round(np.array(sheet.capacity[:2]) * 1e3, 1).tolist() == [64.5, 21.5]
    again = Sheet(**{**FENZ, "capacity": sheet.capacity})
    assert again.dish_diameter == pytest.approx((0.229, 0.089, 0.089, 0.229))


@pytest.mark.parametrize("height", [(0.3, 0.15), (0.35, 0.2)])
@pytest.mark.parametrize(
    ("lengths", "limits", "friction", "sliders"),
    [
        # H.-M. Kim and M. C. Constantinou (2023), configuration A: the example of OpenSees' TripleFrictionPendulumX.
        ((3.7465, 0.3937), (0.5043, 0.0716), (0.04, 0.01, 0.01, 0.08), (0.711, 0.508)),
        # N. Dao (2013): the example that checks OpenSees' TripleFrictionPendulum; without diameters.
        ((1.25, 0.36), (0.2, 0.1), (0.052, 0.012, 0.012, 0.14), (0.30, 0.20)),
    ],
)
def test_devices_of_opensees(
    lengths: tuple[float, float],
    limits: tuple[float, float],
    friction: tuple[float, ...],
    sliders: tuple[float, float],
    height: tuple[float, float],
) -> None:
    """Their effective radii and displacement limits are published, heights are not: nothing here depends on them.

    The capacity is that of the manual of the element, 2 d_1 + d_2 + d_3, where sliders move on the effective radii; the
    regimes are those of Fenz and Constantinou (2008), written out.
    """
    arcs = [d * (L + h) / L for d, L, h in zip(limits, lengths, height, strict=True)]
    backbone = published_backbone(
        Bearing.from_sheet(
            device="triple", effective_radius=lengths, height=height, friction=friction, capacity=arcs,
            slider_diameter=sliders, axial_load=1e6,
        )
    )  # fmt: skip
    check_regimes(backbone, lengths, friction)
    assert backbone.capacity == pytest.approx(2 * sum(limits))


def check_regimes(backbone: Backbone, lengths: tuple[float, float], friction: tuple[float, ...]) -> None:
    """The first three regimes of a symmetric triple pendulum as Fenz and Constantinou (2008) have them."""
    (outer, inner), (mu1, mu2, _, mu4) = lengths, friction
    first = 2 * (mu1 - mu2) * inner
    second = first + (mu4 - mu1) * (outer + inner)
    drawn = regimes(backbone)
    assert drawn[1][0] == pytest.approx(first) and drawn[2][0] == pytest.approx(second)
    assert [k for *_, k in drawn[:3]] == pytest.approx([1 / (2 * inner), 1 / (outer + inner), 1 / (2 * outer)])
    mean = (mu1 + mu4) / 2 - ((mu1 + mu4) / 2 - mu2) * inner / outer
    assert characteristic(backbone) == pytest.approx((mean, 2 * outer))


def test_example_of_the_element_of_becker() -> None:
    """T. Becker (2011), element TFP in the manual of OpenSees: radii, heights and all diameters, in inches.

    From it u* = 2 (0.09 - 0.02) 9 = 1.26 in and u** = 1.26 + (0.12 - 0.09) (83.5 + 9) = 4.035 in. The element takes
    half the difference of the diameters, 15.75 and 2 in, in place of the arc between them.
    """
    inch, friction = 0.0254, (0.09, 0.02, 0.02, 0.12)
    data = Sheet(
        device="triple", radius=(88 * inch, 12 * inch), height=(4.5 * inch, 3 * inch), friction=friction,
        slider_diameter=(12.5 * inch, 8 * inch), dish_diameter=(44 * inch, 12 * inch), axial_load=45 * 4448.22,
    )  # fmt: skip
    assert data.capacity is not None
    arcs = np.array(data.capacity[:2]) / inch
    assert np.all(arcs > [15.75, 2.0]) and arcs == pytest.approx([15.75, 2.0], rel=0.11)
    backbone = published_backbone(Bearing.of_values(data.values))
    check_regimes(backbone, (83.5 * inch, 9 * inch), friction)
    assert [a / inch for a, *_ in regimes(backbone)[1:3]] == pytest.approx([1.26, 4.035])


@pytest.mark.parametrize(
    ("intensity", "period", "damping", "lengths", "friction", "third"),
    [
        (1.021104444, 3.330817955, 0.149402038, (71.8984954, 26.62907237), (0.070898215, 0.029800633), 3.832976957),
        (1.029922353, 2.758190231, 0.111117955, (48.05609135, 32.03739424), (0.153073523, 0.025768391), 3.133650299),
        (1.252042166, 2.542428793, 0.152960955, (42.02422546, 20.01153593), (0.114600733, 0.062113565), 2.930395011),
    ],
)
def test_designs_of_a_database(
    intensity: float,
    period: float,
    damping: float,
    lengths: tuple[float, float],
    friction: tuple[float, float],
    third: float,
) -> None:
    """H. Pham (University of California, Berkeley), tfp-database: sessionOut/sessionSummary.csv, the first three rows.

    Each row is a triple pendulum that was designed for T_M and zeta_M under S_a = S_1/T, with B of ASCE 7: its columns
    are S1 [g], Tm [s], zetaM, R2 and R1 [in], mu2 and mu1, and T2 [s], the period of the third regime. The design
    counts a yield displacement of 0.01 in, by which its damping is up to 0.06 % smaller.
    """
    inch, gravity = 0.0254, 386.4 * 0.0254
    backbone = published_backbone(
        Bearing.from_sheet(
            device="triple", effective_radius=[L * inch for L in lengths], height=[0.35, 0.2], friction=friction,
            capacity=[18 * inch, 8 * inch], slider_diameter=[0.3, 0.2], axial_load=1e6,
        )
    )  # fmt: skip
    assert 2 * pi / sqrt(gravity * regimes(backbone)[1][3]) == pytest.approx(third, rel=1e-9)
    spectrum = [(T, intensity * gravity / T) for T in (0.5, 10.0)]
    found = equivalent(backbone, spectrum, DAMPING["asce7"][0], gravity).at
    assert found.period == pytest.approx(period, rel=1e-4) and found.damping == pytest.approx(damping, rel=1e-3)


def test_specimen_of_a_hybrid_simulation() -> None:
    """A. Schellenberg (2013), Building1DOFwithTMD.tcl of OpenFresco: a triple pendulum with all its lengths, in inches.

    Its script states L_1 = 3.0 - 1.65/2, L_2 = 18.64 - 2.94/2, d_1 = (2.60 - 1.75)/2, d_2 = (9.0 - 3.0)/2: the latter
    half the difference of the diameters, in place of the arc between them.
    """
    inch, kip = 0.0254, 4448.22
    data = Sheet(
        device="triple", radius=(18.64 * inch, 3.0 * inch), height=(2.94 / 2 * inch, 1.65 / 2 * inch),
        friction=(0.13, 0.055), slider_diameter=(3.0 * inch, 1.75 * inch), dish_diameter=(9.0 * inch, 2.60 * inch),
        axial_load=56 * kip,
    )  # fmt: skip
    assert data.effective_radius is not None and data.capacity is not None
    assert np.array(data.effective_radius[:2]) / inch == pytest.approx([17.17, 2.175])
    arcs = np.array(data.capacity[:2]) / inch
    assert np.all(arcs > [3.0, 0.425]) and arcs == pytest.approx([3.0, 0.425], rel=0.08)
    backbone = published_backbone(Bearing.of_values(data.values))
    first = 2 * (0.13 - 0.055) * 2.175 * inch
    assert regimes(backbone)[1][0] == pytest.approx(first)
    assert characteristic(backbone) == pytest.approx((0.13 - 0.075 * 2.175 / 17.17, 2 * 17.17 * inch))
    found = effective(backbone, 2 * inch, 9.81)
    force = 0.13 - 0.075 * 2.175 / 17.17 + 2 / (2 * 17.17)
    assert found.force == pytest.approx(force)
    assert found.period == pytest.approx(2 * pi * sqrt(2 * inch / (9.81 * force)))


def test_single_pendulum_of_the_examples_of_opensees() -> None:
    """A. Schellenberg (2009), TestFPS2d_0.tcl: R = 34.68 in, mu = 0.163, 18 kip, contact area 7.0686 in2.

    The script gives the stiffness of sliding for the element beside it, 0.519 kip/in.
    """
    inch, kip = 0.0254, 4448.22
    slider = 2 * sqrt(7.0686 / pi)
    assert slider == pytest.approx(3.0, rel=1e-5)
    bearing = Bearing.from_sheet(
        device="single", effective_radius=[34.68 * inch], height=[0.0], friction=[0.163],
        slider_diameter=[slider * inch], dish_diameter=[12 * inch], axial_load=18 * kip,
    )  # fmt: skip
    backbone = published_backbone(bearing)
    ((_, _, start, slope),) = regimes(backbone)
    assert start == pytest.approx(0.163) and slope * 18 * inch == pytest.approx(0.519, abs=5e-4)


def test_isolators_of_a_published_plant() -> None:
    """Virtual Test Bed of Idaho National Laboratory, generic MSR: R = 1 m, mu = 0.06, contact radius 0.2 m, 10.75 MN.

    T = 2 pi sqrt(R/g) = 2.01 s, stiffness, damping and pressure by hand.
    """
    bearing = Bearing.from_sheet(
        device="single", radius=[1.0], height=[0.0], friction=[0.06], slider_diameter=[0.4], dish_diameter=[1.2],
        yield_displacement=1e-3, axial_load=10.75e6,
    )  # fmt: skip
    backbone = published_backbone(bearing)
    ((_, _, _, slope),) = regimes(backbone)
    assert 2 * pi / sqrt(9.81 * slope) == pytest.approx(2.006, abs=5e-4)
    found = effective(backbone, 0.2, 9.81)
    assert found.stiffness * 10.75e6 == pytest.approx(10.75e6 * (1.0 + 0.06 / 0.2))
    assert found.damping == pytest.approx(2 / pi * 0.06 / 0.26)
    pressure = 10.75e6 / (pi * 0.2**2)
    assert pressure == pytest.approx(85.5e6, rel=1e-3)


def test_isolator_of_the_reports_on_nuclear_plants() -> None:
    """M. Kumar (2015), element FPBearingPTV in the manual of OpenSees: R = 2.2352 m, mu = 0.06, 50 MPa, r = 0.2 m.

    The manual of MASTODON (Idaho National Laboratory) has its axial load, 6285710 N, and its mass, 640745 kg. The two
    forces are of its reference solution, gold/fp_isolator_shear_P_out.csv, at 1.005 s and 1.5 s.
    """
    load = 6285710.0
    assert load == pytest.approx(50e6 * pi * 0.2**2, rel=5e-4) and load / 9.81 == pytest.approx(640745, abs=1)
    bearing = Bearing.from_sheet(
        device="single", effective_radius=[2.2352], height=[0.0], friction=[0.06], slider_diameter=[0.4],
        capacity=[0.5], yield_displacement=1e-3, axial_load=load,
    )  # fmt: skip
    backbone = published_backbone(bearing)
    for displacement, force in ((1.57063525e-3, 381505.41), (0.1004171505, 659761.70)):
        assert effective(backbone, displacement, 9.81).force * load == pytest.approx(force, rel=5e-4)
    assert 2 * pi / sqrt(9.81 * regimes(backbone)[0][3]) == pytest.approx(3.0, abs=1e-3)


def test_dishes_that_would_meet_are_refused() -> None:
    """Two dishes of one radius, 2 h apart, meet where each is h deep: at sqrt(2 R h - h^2) from the axis."""
    R, h = 0.4, 0.05
    edge = 2 * sqrt(2 * R * h - h**2)
    sheet = {
        "device": "double", "radius": [R], "height": [h], "friction": [0.05], "slider_diameter": [0.1],
        "axial_load": 1e6,
    }  # fmt: skip
    Sheet(**sheet, dish_diameter=[edge - 1e-6])
    with pytest.raises(InputError, match=r"dishes of surfaces 1 and 2 are 0.1 m apart .* they would meet"):
        Sheet(**sheet, dish_diameter=[edge + 1e-6])


def test_pivot_of_a_double_is_where_its_heights_place_it() -> None:
    """Not in the middle of its slider: Q = (mu_1 R_eff1 + mu_2 R_eff2)/(R_eff1 + R_eff2), by hand."""
    bearing = Bearing.from_sheet(
        device="double", radius=[1.5, 2.5], height=[0.02, 0.12], friction=[0.04, 0.08], slider_diameter=[0.4],
        dish_diameter=[1.0, 1.0], axial_load=1.85e6,
    )  # fmt: skip
    height, length = characteristic(published_backbone(bearing))
    assert length == pytest.approx(1.48 + 2.38, rel=1e-12)
    assert height == pytest.approx((0.04 * 1.48 + 0.08 * 2.38) / length, rel=1e-12)


def test_single_and_double_are_one_regime() -> None:
    """F/W = mu + u/R_eff; a rigid slider turns on both dishes at once, whatever their friction."""
    single = published_backbone(Bearing.from_sheet(**SINGLE))
    arc = 2.2 * (asin(0.5 / 2.2) - asin(0.12 / 2.2))
    assert single.points[0].tolist() == pytest.approx([0.0, arc])
    assert single.points[1].tolist() == pytest.approx([0.06, 0.06 + arc / 2.2])
    double = published_backbone(Bearing.from_sheet(**DOUBLE))
    assert characteristic(double) == pytest.approx((0.06, 4.2))
    assert double.capacity == pytest.approx(2 * 2.1 / 2.2 * 0.2)


def test_effective_properties_by_hand() -> None:
    """k_eff = W (mu + D/R)/D, T = 2 pi sqrt(W/(g k)), beta = 2 mu/(pi (mu + D/R)) of a single pendulum."""
    found = effective(published_backbone(Bearing.from_sheet(**SINGLE)), 0.3, 9.81)
    force = 0.06 + 0.3 / 2.2
    assert found.force == pytest.approx(force) and found.stiffness == pytest.approx(force / 0.3)
    assert found.period == pytest.approx(2 * pi * sqrt(0.3 / (9.81 * force)))
    assert found.energy == pytest.approx(4 * 0.06 * 0.3) and found.damping == pytest.approx(2 * 0.06 / (pi * force))


@pytest.mark.parametrize("sheet", [FENZ, DOUBLE, QUINTUPLE])
@pytest.mark.parametrize("share", [0.1, 0.4, 0.7, 1.0])
def test_damping_is_the_area_of_a_loop_of_links_in_series(sheet: dict[str, Any], share: float) -> None:
    """The loop drawn step by step: every link a slider of rigid friction, a pendulum and stops, under one force."""
    backbone = published_backbone(Bearing.from_sheet(**sheet))
    found = effective(backbone, share * backbone.capacity, 9.8)
    tilt = np.zeros(len(backbone.links))
    path = np.concatenate([np.linspace(a, b, 4001) for a, b in ((0, 1), (1, -1), (-1, 1), (1, -1))]) * found.force
    u = np.empty_like(path)
    for row, force in enumerate(path):
        for index, link in enumerate(backbone.links):
            outside = 0.0 if link.outside is None else tilt[link.outside]
            moved = min(max(tilt[index], force - link.friction), force + link.friction)
            tilt[index] = min(max(moved, outside - link.limit), outside + link.limit)
        u[row] = sum(link.share * angle for link, angle in zip(backbone.links, tilt, strict=True))
    cycle = slice(2 * 4001, None)
    assert u[4000] == pytest.approx(found.displacement)
    assert abs(np.trapezoid(path[cycle], u[cycle])) == pytest.approx(found.energy, rel=2e-3)


def test_masses_of_steel() -> None:
    """A half ball and a disc in closed form; and a body as it is drawn, cut into slices."""
    mass, centroid, (transverse, axial) = revolved(0.1, (0.1, 0.1, 1.0), None, 7850.0)
    ball = 7850 * 2 / 3 * pi * 1e-3
    assert (mass, centroid) == pytest.approx((ball, 5 / 8 * 0.1), rel=1e-4)
    assert axial == pytest.approx(0.4 * ball * 0.01, rel=1e-4)
    assert transverse == pytest.approx(83 / 320 * ball * 0.01, rel=1e-4)
    made = Bearing.from_sheet(**FENZ)
    for index, body in enumerate(made.bodies[:3], start=1):
        radius, height = outline(made, index).T
        slices = pi * np.trapezoid(radius**2, height)
        assert body.mass == pytest.approx(7850 * abs(slices), rel=0.06)  # the drawing has rims, the mass none


def test_centroids_follow_the_report() -> None:
    """z is from the bottom below the pivot and from the top above it (3.6), (3.10): equal in a symmetric stack."""
    bodies = Bearing.from_sheet(**FENZ).bodies
    assert bodies[0].centroid == pytest.approx(bodies[2].centroid) and bodies[1].centroid == pytest.approx(0.023)
    assert bodies[0].centroid > bodies[0].height / 2  # the dish of the inner slider has its steel at its rim


def test_scene_file_takes_a_sheet_with_changes() -> None:
    """Texts with units, other keys that change the bearing; its complete table keeps friction at the pivot."""
    table = {"sheet": {**BOUNDED, "radius": ["0.473 m", 0.076]}, "mass": [1.0, 2.0, 1.0, 8.0], "gravity": 9.81}
    made = bearing_from_table(table)
    assert made == Bearing.from_sheet(**BOUNDED).replace(mass=[1.0, 2.0, 1.0, 8.0], gravity=9.81)
    whole = complete_bearing(table)
    assert whole["friction_at"] == "pivot" and bearing_from_table(whole) == made
    assert [row["friction"] for row in whole["surfaces"]] == BOUNDED["friction"]
    for wrong in ({"friction": 0.1}, {"friction_at": "surface"}):
        with pytest.raises(InputError, match="unknown key"):
            bearing_from_table({**table, **wrong})


def scene_of(sheet: dict[str, Any]) -> Any:
    ramp = {"kind": "ramp", "acceleration": 0.1, "duration": 1.0}
    top = {"kind": "rig", "axial_load": 2e6, "stiffness": 1e9, "damping": 1e3}
    return scene_from_table({"bearing": {"sheet": sheet}, "motion": ramp, "top": top})


@pytest.mark.parametrize(
    "sheet", [BOUNDED, {**SINGLE, "friction_lower": [0.04], "friction_upper": [0.09]}], ids=["triple", "single"]
)
def test_bound_takes_the_values_of_the_sheet(sheet: dict[str, Any]) -> None:
    """The bearing at each bound is that of a sheet with these values as its friction; no factor is applied."""
    scene = scene_of(sheet)
    assert factors_of(scene) is SHEET
    scenes = bounded_scenes(scene, SHEET)
    plain = {name: value for name, value in sheet.items() if not name.startswith("friction")}
    for case, name in (("lower", "friction_lower"), ("nominal", "friction"), ("upper", "friction_upper")):
        expected = Bearing.from_sheet(**plain, friction=sheet[name])
        found = scenes[case].every_bearing[0]
        np.testing.assert_allclose(found.arrays()["friction"], expected.arrays()["friction"], rtol=1e-12)
    lower = _lambdas(scene.bearing, SHEET)["friction"]["lower"]
    ratios = np.divide(sheet["friction_lower"], sheet["friction"])
    assert lower[: len(ratios)] == pytest.approx(ratios.tolist())


def test_a_bearing_without_bounds_takes_factors() -> None:
    scene = load_scene("fenz-test1")
    assert factors_of(scene).name == "asce7"
    with pytest.raises(InputError, match="friction_lower is missing"):
        bounded_scenes(scene, SHEET)


def test_bounds_go_where_friction_changes() -> None:
    """Bounds belong to the coefficients with which they were given."""
    made = Bearing.from_sheet(**BOUNDED)
    assert made.replace(gravity=9.81).friction_lower == made.friction_lower
    assert made.replace(friction=0.05).friction_lower is None
    assert replace(made, friction_lower=None).friction_upper == made.friction_upper
    again = made.replace(friction=0.05, friction_lower=[0.04] * 4, friction_upper=[0.06] * 4, friction_at="pivot")
    assert again.friction_lower is not None and again.friction_at_pivot == pytest.approx((0.05,) * 4)
