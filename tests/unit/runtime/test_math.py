"""The elementary functions of the runtime: accuracy and limits."""

from __future__ import annotations

import ctypes
import re
import subprocess

import mpmath as mp
import numpy as np
import pytest
from support import ROOT, Array

from msfp_gen import Effects, Layout
from msfp_gen.generator import generate
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.specification.layout import ModelSpec

HEADER = ROOT / "msfp_gen" / "runtime" / "msfp_math.h"
ONE, TWO = ("sin", "cos", "asin", "exp", "log", "tanh"), ("atan2", "hypot", "pow")
SOURCE = '#include "msfp_math.h"\n' + "".join(
    [f"double {name}_(double x) {{ return msfp_{name}(x); }}\n" for name in ONE]
    + [f"double {name}_(double x, double y) {{ return msfp_{name}(x, y); }}\n" for name in TWO]
)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("math")
    (folder / "math.c").write_text(SOURCE, encoding="utf-8")
    flags = [*FLAGS["c"], "-fvisibility=default", "-Werror", f"-I{HEADER.parent}", "-shared"]
    subprocess.run([*find_compiler().command, *flags, "math.c", "-o", "math.so", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "math.so"))


def evaluated(library: ctypes.CDLL, name: str, *arguments: Array) -> Array:
    function = getattr(library, f"{name}_")
    function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double] * len(arguments)
    return np.array([function(*values) for values in zip(*arguments, strict=True)])


def units(found: Array, exact: list[mp.mpf]) -> float:
    """Largest error in units of the last digit."""
    return float(max(abs(mp.mpf(float(a)) - b) / np.spacing(abs(float(b))) for a, b in zip(found, exact, strict=True)))


@pytest.mark.parametrize(
    ("name", "low", "high", "allowed"),
    [
        ("sin", -0.785, 0.785, 1.0), ("sin", -30.0, 30.0, 2.0), ("sin", 1e4, 9.9e4, 2.0),
        ("cos", -0.785, 0.785, 1.0), ("cos", -30.0, 30.0, 2.0), ("cos", 1e4, 9.9e4, 2.0),
        ("asin", -0.5, 0.5, 1.0), ("asin", -1.0, 1.0, 3.0), ("exp", -2.0, 2.0, 1.0), ("exp", -700.0, 700.0, 1.0),
        ("log", 0.5, 2.0, 1.0), ("log", 1e-12, 1e12, 1.0), ("tanh", -0.3, 0.3, 3.0), ("tanh", -30.0, 30.0, 3.0),
    ],
)  # fmt: skip
def test_errors_in_units_of_the_last_digit(
    library: ctypes.CDLL, name: str, low: float, high: float, allowed: float
) -> None:
    mp.mp.prec = 120
    x = np.random.default_rng(7).uniform(low, high, 4000)
    x = np.concatenate([x, x * 1e-3, x[:200] * 1e-9]) if low < 0 else x
    assert units(evaluated(library, name, x), [getattr(mp, name)(mp.mpf(float(v))) for v in x]) < allowed


def test_functions_of_two_arguments(library: ctypes.CDLL) -> None:
    mp.mp.prec = 120
    rng = np.random.default_rng(8)
    x, y = rng.uniform(-3, 3, (2, 4000)) * 10.0 ** rng.integers(-8, 3, (2, 4000))
    pairs = [(mp.mpf(float(a)), mp.mpf(float(b))) for a, b in zip(x, y, strict=True)]
    assert units(evaluated(library, "atan2", y, x), [mp.atan2(b, a) for a, b in pairs]) < 4.0
    assert units(evaluated(library, "hypot", x, y), [mp.hypot(a, b) for a, b in pairs]) < 2.0
    base, power = np.abs(x), y / 300.0
    found = evaluated(library, "pow", base, power)
    exact = [mp.mpf(float(b)) ** mp.mpf(float(p)) for b, p in zip(base, power, strict=True)]
    bound = 1.0 + 2.0 * np.abs(power * np.log(base))
    errors = [float(abs(mp.mpf(float(a)) - b) / np.spacing(float(b))) for a, b in zip(found, exact, strict=True)]
    assert np.all(np.array(errors) < bound)


def test_limits(library: ctypes.CDLL) -> None:
    inf, nan = np.inf, np.nan

    def values(name: str, *arguments: list[float]) -> list[float]:
        return evaluated(library, name, *map(np.array, arguments)).tolist()

    np.testing.assert_array_equal(values("exp", [inf, -inf, nan, 0.0, 1e9, -1e9]), [inf, 0.0, nan, 1.0, inf, 0.0])
    np.testing.assert_array_equal(values("log", [inf, 0.0, -1.0, nan, 1.0]), [inf, -inf, nan, nan, 0.0])
    np.testing.assert_array_equal(values("sin", [inf, nan, 0.0, 1e300]), [nan, nan, 0.0, np.sin(1e300)])
    np.testing.assert_array_equal(values("asin", [1.0, -1.0, 1.0000001, nan]), [np.pi / 2, -np.pi / 2, nan, nan])
    np.testing.assert_array_equal(values("hypot", [inf, 0.0, 1e-200], [1.0, 0.0, 0.0]), [inf, 0.0, 1e-200])
    np.testing.assert_array_equal(values("atan2", [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]), [np.pi, 0.0, np.pi / 2])
    # The step control divides by the error of a step, which may be zero.
    np.testing.assert_array_equal(values("pow", [0.0, 0.0, 2.0, -2.0], [-0.3, 0.3, 0.0, 0.5]), [inf, 0.0, 1.0, nan])
    np.testing.assert_allclose(values("pow", [-2.0, -2.0, -0.5], [3.0, 6.0, -5.0]), [-8.0, 64.0, -32.0], rtol=1e-14)
    np.testing.assert_array_equal(values("tanh", [inf, -inf, nan, 0.0]), [1.0, -1.0, nan, 0.0])


def test_no_kernel_calls_the_functions_of_the_system(library: ctypes.CDLL) -> None:
    """In the sources of the runtime and of the run of a building, and in what the generator writes."""
    calls = re.compile(r"(?<![\w.])(?:sin|cos|tan|asin|acos|atan|atan2|exp|log|pow|hypot|tanh|cbrt|fma)\(")
    files = [*(ROOT / "msfp_gen" / "runtime").rglob("*.[ch]")]
    files += (ROOT / "msfp_gen" / "buildings" / "compiled").rglob("*.[ch]")
    texts = {str(path): path.read_text(encoding="utf-8") for path in files if path != HEADER}
    texts |= generate(ModelSpec(Layout(2, 1, 0), Effects(friction="velocity"))).files
    comment = re.compile(r"/\*.*?\*/", flags=re.DOTALL)
    lines = [(name, line) for name, text in texts.items() for line in comment.sub("", text).splitlines()]
    assert len(texts) > 40 and not [(name, line) for name, line in lines if calls.search(line)]
