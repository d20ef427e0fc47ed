import math
import subprocess
import sys

import pytest

from msfp_gen.common.fields import Quantity, to_si


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


def test_text_is_for_files_only():
    with pytest.raises(ValueError, match="finite number"):
        Quantity("m").parse("75 mm")


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
