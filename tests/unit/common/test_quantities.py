import math
import subprocess
import sys
from dataclasses import fields

import pytest
from support import ROOT

from msfp_gen import Bearing, Body, InputError, Limits, Load, Motion, Rotation, Storey, Surface, Top
from msfp_gen.common.fields import G, Quantity, to_si


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("112 kN", "N", 112e3),
        ("75 mm", "m", 0.075),
        ("-1.5e-1 cm", "m", -0.0015),
        ("0.45 kg", "kg", 0.45),
        ("450 g", "kg", 0.45),
        ("1 g", "m/s^2", 9.80665),
        ("0.5 g", "m/s^2", 4.903325),
        ("100 gal", "m/s^2", 1.0),
        ("100 cm/s²", "m/s^2", 1.0),
        ("980 cm/s^2", "m/s^2", 9.8),
        ("980 cm/s2", "m/s^2", 9.8),
        ("3.01 kg cm2", "kg m^2", 3.01e-4),
        ("5 N s/m", "N s/m", 5.0),
        ("5 kN*s/m", "N s/m", 5e3),
        ("1e3 kN·m/rad", "N m/rad", 1e6),
        ("1 MN m", "N m/rad", 1e6),
        ("3 %", "", 0.03),
        ("90 deg", "rad", math.pi / 2),
        ("180°", "rad", math.pi),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("2 min", "s", 120.0),
        ("100 mHz", "Hz", 0.1),
        ("10 kN/mm", "N/m", 1e7),
        ("3.01 kg cm^2", "kg m^2", 3.01e-4),
        ("18 W/(m K)", "W/(m K)", 18.0),
        ("0.18 W / (cm*K)", "W/(m K)", 18.0),
        ("68 degF", "degC", 20.0),
        ("4.44 mm^2/s", "m^2/s", 4.44e-6),
    ],
)
def test_units_become_si(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "word"),
    [
        ("1 g", "N", "not a unit of [N]"),
        ("1 g", "m", "not a unit of [m]"),
        ("9.8 m/s", "m/s^2", "not a unit of [m/s^2]"),
        ("0.1 Hz", "rad/s", "not a unit of [rad/s]"),
        ("0.1 rad/s", "Hz", "not a unit of [Hz]"),
        ("5 m/m", "rad", "not a unit of [rad]"),
        ("3 mm", "", "has no unit"),
        ("3 wibble", "m", "unknown"),
        ("3", "m", "names no unit"),
        ("mm", "m", "no number"),
        ("1 m; 2", "m", "no number"),
        ("__import__('os')", "m", "no number"),
        ("1 m**9**9", "m", "no number"),
        ("", "m", "no number"),
        ("20 degC", "m", "not a unit"),
    ],
)
def test_other_texts_are_refused(text, unit, word):
    with pytest.raises(ValueError) as error:
        to_si(text, unit)
    assert word in str(error.value)
    assert "give" in str(error.value)


def test_infinity_cannot_come_in_through_a_text():
    with pytest.raises(ValueError, match="finite"):
        Quantity("m").parse("1e999 m", text=True)


def test_a_number_alone_takes_no_text():
    with pytest.raises(ValueError, match="finite number"):
        Quantity("m").parse("75 mm")


def test_constructors_take_texts_with_units():
    """The inch, the kip, the pound and the degree by their definitions: 25.4 mm, 1000 lbf, 0.45359237 kg."""
    pound = 0.45359237 * 9.80665  # lbf [N]
    row = Surface(radius="39 in", capacity="12.5 in", friction="4 %", yield_displacement="0.5 mm")
    assert (row.radius, row.friction) == pytest.approx((39 * 0.0254, 0.04), rel=1e-14)
    assert Body(height="2 in", centroid="1 in", mass="40 lb", inertia=("30 kg cm^2", 0.003)).mass == pytest.approx(
        40 * 0.45359237, rel=1e-14
    )
    assert Top.rig(axial_load="25 kip", stiffness="10 kip/in").axial_load == pytest.approx(25e3 * pound, rel=1e-14)
    assert Top.prescribed(force=(0, 0, "-100 kN")).force == (0.0, 0.0, -1e5)
    assert Limits(displacement="760 mm").displacement == 0.76
    assert Storey("10 ft", 1e3, (1.0, 1.0, 1.0), "10 kN/m", 1e6).stiffness == (1e4, 1e4)
    assert row == Surface(radius=39 * 0.0254, capacity=12.5 * 0.0254, friction=0.04, yield_displacement=5e-4)


def test_motions_and_loads_take_texts_with_units():
    assert Motion.harmonic("25 mm", "500 mHz", direction="90 deg", lead_in="1 min") == Motion.harmonic(
        0.025, 0.5, direction=math.pi / 2, lead_in=60.0
    )
    assert Motion.circle("25 mm", "1 rad/s", lead_in="2 s") == Motion.circle(0.025, 1.0, lead_in=2.0)
    assert Motion.ramp("0.01 g", "3 s") == Motion.ramp(0.01 * G, 3.0)
    assert Load.ramp((0, 0, "100 kN"), duration="2 s") == Load.ramp((0, 0, 1e5), duration=2.0)
    assert Load.from_arrays([0, 1], [[0, 0, 0], [0, 0, "1 MN"]]) == Load.from_arrays([0, 1], [[0, 0, 0], [0, 0, 1e6]])
    assert Rotation.constant(theta="1 deg") == Rotation.constant(theta=math.pi / 180)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Surface("39 kg", 0.1, 0.04, 1e-3), ("surface.radius = '39 kg'", "not a unit of [m]", "give")),
        (lambda: Surface("39", 0.1, 0.04, 1e-3), ("surface.radius = '39'", "names no unit", "give")),
        (lambda: Top.rig("112 kN", "1 MN"), ("top.stiffness = '1 MN'", "not a unit of [N/m]")),
        (lambda: Motion.harmonic("25 mm", "0.5 rad/s"), ("frequency = '0.5 rad/s'", "not a unit of [Hz]")),
        (lambda: Load.constant((0, 0, "1 m")), ("force = '1 m'", "not a unit of [N]")),
        (lambda: Motion.ramp("-0.1 g", 3.0), ("acceleration", "give one", "-0.980665")),
    ],
)
def test_texts_of_another_unit_are_refused(make, words):
    with pytest.raises(InputError) as error:
        make()
    assert "\n" not in str(error.value) and all(word in str(error.value) for word in words), str(error.value)


def test_standard_gravity_stands_in_one_place():
    assert to_si("1 g", "m/s^2") == G
    sources = [path for folder in ("msfp_gen", "generator") for path in (ROOT / folder).rglob("*.py")]
    assert [path.name for path in sources if "= 9.80665" in path.read_text(encoding="utf-8")] == ["fields.py"]


def test_numpy_numbers_and_arrays_are_numbers():
    import numpy as np

    assert Quantity("m").parse(np.float32(0.5)) == 0.5
    assert Quantity("", whole=True).parse(np.int64(3)) == 3
    assert Quantity("N", shape=(3,)).parse(np.arange(3.0)) == (0.0, 1.0, 2.0)
    with pytest.raises(ValueError):
        Quantity("N", shape=(3,)).parse(np.arange(4.0))


def test_pint_is_imported_only_for_a_unit():
    code = (
        "import sys; from msfp_gen.scene.file.presets import scene; scene('fenz-test1'); print('pint' in sys.modules);"
        "from msfp_gen.common.fields import to_si; to_si('1 mm', 'm'); print('pint' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


def test_pages_tell_the_default_gravity_from_the_unit():
    """A record of 0.4 g is 0.06 % more than 0.4 of the default gravity, so a reader who compares them must know."""
    rows = [
        line
        for page in ("scene", "glossary")
        for line in (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8").splitlines()
        if line.startswith(("| `gravity`", "| gravity"))
    ]
    default = next(field.default for field in fields(Bearing) if field.name == "gravity")
    assert len(rows) == 2 and all(f"{default}" in row and f"{G}" in row for row in rows)
