"""Emitted kernels as compiled, against formulas that share nothing with their programs, and against differences."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from support import Array

from msfp_gen import Effects, Layout
from msfp_gen.generator import generate
from msfp_gen.generator.derive import Equations, derive
from msfp_gen.generator.lower import GRADIENT_COLUMNS
from msfp_gen.generator.places import calls_of, output_is_stored, passes_of
from msfp_gen.generator.schedule import beside
from msfp_gen.jit.build import runtime_sources
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.specification.layout import ModelSpec

QUASISTATIC = {"dimension": "planar", "sliders": "massless", "rims": False}
SHOWN = ("friction_after_slip", "slip_work")


class Kernels:
    """Some kernels of a model, which take and return {block: {field: value}} and {field: value}."""

    def __init__(self, folder: Path, names: tuple[str, ...], effects: dict[str, object]) -> None:
        spec = ModelSpec(Layout(2, 1, 0), Effects(**effects), gradients=not effects.get("uplift"))  # type: ignore[arg-type]
        equations: Equations = derive(spec)
        self.programs = {p.name: p for p in equations.programs if p.name in names}
        assert set(self.programs) == set(names)
        header = "msfp_gradient_kernels.h" if spec.gradients else "msfp_kernels.h"
        source = f'#include "{header}"\n'
        alone = {call.program: call for call in calls_of(passes_of(beside(spec.effects)))}
        for program in self.programs.values():
            blocks = [use.alias for use in program.inputs]
            source += self._wrapped(program.name, [*blocks, "out"])
            if spec.gradients and program.name in alone:
                stored = ["out"] if output_is_stored(alone[program.name]) else []
                moved = [*blocks, *stored, *(f"d{name}" for name in [*blocks, *stored]), "dout"]
                source += self._wrapped(f"{program.name}_direction", moved)
        for name, content in (runtime_sources(spec) | generate(spec).files | {"kernels.c": source}).items():
            (folder / name).write_text(content, encoding="utf-8")
        flags = [*FLAGS["c"], "-fvisibility=default", "-Werror", "-shared"]
        subprocess.run([*find_compiler().command, *flags, "kernels.c", "-o", "k.so", "-lm"], cwd=folder, check=True)
        self.library = ctypes.CDLL(str(folder / "k.so"))

    @staticmethod
    def _wrapped(name: str, arguments: list[str]) -> str:
        given = ", ".join(f"{'' if a in ('out', 'dout') else 'const '}double *{a}" for a in arguments)
        return f"void {name}_({given}) {{ msfp_{name}({', '.join(arguments)}); }}\n"

    def __call__(self, name: str, **given: dict[str, float]) -> dict[str, float]:
        """Values of the results."""
        program = self.programs[name]
        assert program.output is not None
        fields = [f.name for f in program.output.block.fields]
        out = np.zeros(len(fields))
        self._call(name, [*self._blocks(name, given), out])
        return dict(zip(fields, out, strict=True))

    def slopes(self, name: str, alias: str, field: str, **given: dict[str, float]) -> dict[str, float]:
        """Derivatives of the results with respect to one input."""
        program = self.programs[name]
        assert program.output is not None
        blocks, fields = self._blocks(name, given), [f.name for f in program.output.block.fields]
        moves = [np.zeros((len(block), GRADIENT_COLUMNS)) for block in blocks]
        for use, move in zip(program.inputs, moves, strict=True):
            if use.alias == alias:
                move[[f.name for f in use.block.fields].index(field)] = np.arange(1, GRADIENT_COLUMNS + 1)
        out = np.zeros((len(fields), GRADIENT_COLUMNS))
        self._call(f"{name}_direction", [*blocks, *moves, out])
        assert np.allclose(out, np.outer(out[:, 0], np.arange(1, GRADIENT_COLUMNS + 1)), rtol=1e-12, atol=1e-12)
        return dict(zip(fields, out[:, 0], strict=True))

    def _blocks(self, name: str, given: dict[str, dict[str, float]]) -> list[Array]:
        return [
            np.array([given.get(use.alias, {}).get(f.name, 0.0) for f in use.block.fields])
            for use in self.programs[name].inputs
        ]

    def _call(self, name: str, arrays: list[Array]) -> None:
        getattr(self.library, f"{name}_")(*(ctypes.c_void_p(array.ctypes.data) for array in arrays))


SURFACE = {"sign": -1.0, "R": 0.5, "mu": 0.1, "dy": 0.01, "td": 0.02}
PER_TURN = 50.0  # -sign R/d_y
START, SLIPS = (-1.0, -0.6, 0.0, 0.3, 0.9, 1.0), (-3.0, -0.5, -1e-3, 1e-3, 0.2, 0.8, 40.0)


class BoucWen:
    """dY/ds is 1 while friction unloads, then 1 - Y^2; it dissipates the integral of Y^3 ds against the slip."""

    def parts(self, Y: float, slip: float) -> tuple[int, mp.mpf, mp.mpf]:
        """Sign of the slip, y along it once friction does not unload, the slip left."""
        sign = 1 if slip > 0 else -1
        unloading = min(max(-sign * mp.mpf(Y), 0), abs(slip))
        return sign, sign * mp.mpf(Y) + unloading, abs(slip) - unloading

    def after(self, Y: float, slip: float) -> mp.mpf:
        sign, y, rest = self.parts(Y, slip)
        return sign * (y if rest == 0 or y == 1 else mp.tanh(mp.atanh(y) + rest))

    def sheared(self, Y: float, speed: float) -> mp.mpf:
        return Y + SURFACE["td"] * speed * (1 - Y**2 if Y * speed > 0 else 1)

    def lost(self, Y: float, slip: float) -> mp.mpf:
        _, y, rest = self.parts(Y, slip)
        return rest if y == 1 else mp.quad(lambda x: mp.tanh(mp.atanh(y) + x) ** 3, mp.linspace(0, rest, 9))

    def slopes(self, Y: float, slip: float) -> tuple[mp.mpf, mp.mpf]:
        """Of `lost`, by Y and by the slip."""
        sign, y, rest = self.parts(Y, slip)
        end = sign * self.after(Y, slip)
        by_slip = end**3 if rest else mp.mpf(0)
        return sign * ((end**3 - y**3) / (1 - y**2) if sign * Y >= 0 else by_slip), sign * by_slip


class Plastic:
    """Y + s between -1 and 1; the slip beyond is dissipated."""

    def after(self, Y: float, slip: float) -> mp.mpf:
        return max(min(Y + mp.mpf(slip), mp.mpf(1)), mp.mpf(-1))

    def sheared(self, Y: float, speed: float) -> mp.mpf:
        return self.after(Y, SURFACE["td"] * speed)

    def lost(self, Y: float, slip: float) -> mp.mpf:
        return abs(Y + mp.mpf(slip) - self.after(Y, slip))

    def slopes(self, Y: float, slip: float) -> tuple[mp.mpf, mp.mpf]:
        slope = mp.sign(Y + slip) if abs(Y + slip) > 1 else mp.mpf(0)
        return slope, slope


Friction = tuple[Kernels, BoucWen | Plastic]


@pytest.fixture(scope="module", params=["report", "plastic"])
def friction(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Friction]:
    kernels = Kernels(tmp_path_factory.mktemp("slip"), SHOWN, QUASISTATIC | {"bouc_wen": request.param})
    with mp.workdps(25):
        yield kernels, BoucWen() if request.param == "report" else Plastic()


@pytest.mark.parametrize("Y", START)
def test_friction_after_the_slip_of_a_step(friction: Friction, Y: float) -> None:
    """Its rotation is turn + beta rate; derivatives against differences where the formula has two sides."""
    kernels, model = friction

    def slid(Y: float, turn: float, beta: float, rate: float) -> tuple[mp.mpf, mp.mpf]:
        end = model.after(Y, PER_TURN * (turn + beta * rate))
        return end, model.sheared(end, PER_TURN * rate)

    for slip, rate in product(SLIPS, (0.0, 0.07, -0.4)):
        at = [mp.mpf(x) for x in (Y, slip / PER_TURN - 0.01 * rate, 0.01, rate)]
        given = {
            "par": SURFACE,
            "s": dict(zip(("Y", "turn", "beta"), map(float, at), strict=False)),
            "loc": {"dwy": rate},
        }
        found, want = kernels("friction_after_slip", **given), slid(*at)
        assert (found["Y"], found["g"]) == pytest.approx(tuple(map(float, want)), abs=2e-15)
        if abs(Y) == 1.0 or rate == 0.0 or abs(abs(want[1]) - 1) < 1e-9:
            continue
        for i, (alias, name) in enumerate((("s", "Y"), ("s", "turn"), ("s", "beta"), ("loc", "dwy"))):
            low, high = (slid(*at[:i], at[i] + step, *at[i + 1 :]) for step in (-mp.mpf("1e-9"), mp.mpf("1e-9")))
            slopes = kernels.slopes("friction_after_slip", alias, name, **given)
            expected = [float((b - a) / mp.mpf("2e-9")) for a, b in zip(low, high, strict=True)]
            assert (slopes["Y"], slopes["g"]) == pytest.approx(expected, rel=1e-9, abs=1e-9), (alias, name)


@pytest.mark.parametrize("Y", START)
def test_work_of_friction_over_a_slip(friction: Friction, Y: float) -> None:
    kernels, model = friction
    normal, end = 2e4, 0.25
    size = normal * SURFACE["mu"] * SURFACE["dy"]
    for slip in SLIPS:
        given = {"par": SURFACE, "s": {"Y": Y, "turn": slip / PER_TURN}, "e": {"Y": end, "N": normal}}
        found = kernels("slip_work", **given)
        assert found["stored"] == pytest.approx(size * (end**2 - Y**2) / 2, rel=1e-14)
        assert found["lost"] == pytest.approx(size * float(model.lost(Y, slip)), abs=1e-15 * size * (1 + abs(slip)))
        by_friction = kernels.slopes("slip_work", "par", "mu", **given)
        assert by_friction == pytest.approx({name: work / SURFACE["mu"] for name, work in found.items()}, rel=1e-13)
        if abs(Y) == 1.0:  # one-sided
            continue
        slopes = [kernels.slopes("slip_work", "s", name, **given)["lost"] / size for name in ("Y", "turn")]
        by_Y, by_slip = (float(x) for x in model.slopes(Y, slip))
        assert slopes == pytest.approx([by_Y, PER_TURN * by_slip], abs=1e-14 * PER_TURN)
        by_length = kernels.slopes("slip_work", "par", "dy", **given)["lost"]  # the slip over d_y shrinks as d_y grows
        assert by_length * SURFACE["dy"] == pytest.approx(found["lost"] - size * by_slip * slip, abs=1e-12 * size)


def test_friction_at_rest_is_elastic(friction: Friction) -> None:
    """Newton's method starts from bodies at rest: there the slope is that of unloading, also where friction is full."""
    kernels, _ = friction
    for Y in (-0.5, 0.5):
        given = {"par": SURFACE, "s": {"Y": Y}}
        assert kernels("friction_after_slip", **given) == {"Y": Y, "g": Y}
        assert kernels.slopes("friction_after_slip", "s", "turn", **given)["Y"] == pytest.approx(PER_TURN, rel=1e-15)


@pytest.fixture(scope="module")
def contact(tmp_path_factory: pytest.TempPathFactory) -> Kernels:
    names = ("unilateral_depth", "unilateral_inside", "unilateral_edge")
    return Kernels(tmp_path_factory.mktemp("uplift"), names, {"dimension": "planar", "uplift": True})


def test_penetration_is_the_largest_over_the_footprint(contact: Kernels) -> None:
    """Of all directions up to the edge of the footprint; the force is ks times it by the kernel of that contact."""
    half, tilt, par = 0.3, 0.2, {"ks": 1e7}
    par |= {"ca": np.cos(half), "sa": np.sin(half)}
    slider = {"t3x": np.sin(tilt), "t3z": np.cos(tilt)}
    rng, seen = np.random.default_rng(3), set()
    for angle in rng.uniform(-np.pi, np.pi, 60):
        d = 1e-4 * np.array([np.sin(angle), np.cos(angle)])
        given = {"par": par, "b": slider, "x": {"dx": d[0], "dz": d[1]}}
        found = contact("unilateral_depth", **given)
        directions = tilt + np.linspace(-half, half, 20001)
        penetration = np.max(-d[0] * np.sin(directions) - d[1] * np.cos(directions))
        assert found["depth"] == pytest.approx(penetration, abs=1e-12)
        turned = (angle + np.pi - tilt + np.pi) % (2 * np.pi) - np.pi  # of the compression from the axis
        kind = "inside" if abs(turned) < half else "edge"
        assert (found["beyond"] > 0) == (kind == "edge")
        assert abs(found["beyond"]) == pytest.approx(1e-4 * abs(np.sin(abs(turned) - half)), abs=1e-18)
        if penetration > 0:
            force = contact(f"unilateral_{kind}", **given)
            assert np.hypot(force["Fx"], force["Fz"]) == pytest.approx(par["ks"] * found["depth"], rel=1e-12)
            seen.add(kind)
    assert seen == {"inside", "edge"}


@pytest.fixture(scope="module")
def top(tmp_path_factory: pytest.TempPathFactory) -> Kernels:
    return Kernels(tmp_path_factory.mktemp("top"), ("spring_stage", "resting_foot"), {"dimension": "planar"})


def stage(mass: mp.mpf, kv: mp.mpf, cv: mp.mpf, beta: mp.mpf) -> dict[str, mp.mpf]:
    """Solution of m y'' = kv (C - y) + cv (V - y') - m w with y = Q + beta y', y' = P + beta y''.

    (m + beta cv + beta^2 kv) y'' = kv (C - Q - beta P) + cv (V - P) - m w.
    """
    held = mass + beta * cv + beta**2 * kv
    return {"beta": beta, "mobility": 1 / held, "share": mass / held}


@mp.workdps(30)
def test_constants_of_the_stage_of_a_foot(top: Kernels) -> None:
    at = [mp.mpf(x) for x in (3e3, 5e6, 1e4, 1e-2)]
    before = {"y": 0.4, "y1": 0.1}
    given = {"par": {"m": 8e3, "mz": 5e3, "kv": 5e6, "cv": 1e4}, "f": {**before, "beta": 1e-2}}
    want = {name: float(value) for name, value in stage(*at).items()}
    assert top("spring_stage", **given) == pytest.approx(before | want, rel=1e-15)
    for i, (alias, name) in enumerate((("par", "m"), ("par", "kv"), ("par", "cv"), ("f", "beta"))):
        step = mp.mpf(1e-9) * at[i]
        low, high = (stage(*at[:i], at[i] + sign * step, *at[i + 1 :]) for sign in (-1, 1))
        slopes = top.slopes("spring_stage", alias, name, **given)
        for result in want:
            assert slopes[result] == pytest.approx(float((high[result] - low[result]) / (2 * step)), rel=1e-12, abs=0)


def test_the_spring_of_a_rig_has_a_fixed_end(top: Kernels) -> None:
    given = {"par": {"m": 5e3, "mz": 5e3, "kv": 5e6, "cv": 1e4}, "f": {"y": 0.4, "beta": 1e-2}}
    fixed = {"y": 0.4, "y1": 0.0, "beta": 0.0, "mobility": 0.0, "share": 1.0}
    assert top("spring_stage", **given) == fixed
    for alias, name in (("par", "kv"), ("par", "cv"), ("f", "beta")):
        assert not any(top.slopes("spring_stage", alias, name, **given).values())


@pytest.mark.parametrize("stiffness", [0.0, 5e6])
@pytest.mark.parametrize("mass", [0.0, 3e3])
def test_the_foot_at_rest_carries_the_weight(top: Kernels, mass: float, stiffness: float) -> None:
    given = {"par": {"m": mass, "kv": stiffness, "cv": 1e4, "g": 9.8}, "b": {"Cz": 0.7, "Vz": 0.02}}
    sunk = mass * 9.8 / stiffness if stiffness else 0.0
    assert top("resting_foot", **given) == pytest.approx({"y": 0.7 - sunk, "y1": 0.02 if mass else 0.0}, rel=1e-15)
    want = {"kv": sunk / (stiffness or 1.0), "m": -9.8 / stiffness if stiffness else 0.0, "g": -sunk / 9.8}
    for name, slope in want.items():
        assert top.slopes("resting_foot", "par", name, **given)["y"] == pytest.approx(slope, rel=1e-14)
    assert top.slopes("resting_foot", "b", "Cz", **given)["y"] == 1.0


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Kernels:
    return Kernels(tmp_path_factory.mktemp("rows"), ("extreme_length", "bounded_friction", "gap_at"), {})


def test_lengths_have_a_kink_at_zero(rows: Kernels) -> None:
    """Of an extreme, and of the sliding displacement: there their derivatives count as zero."""
    pair = {"v": {"x": 0.3, "y": -0.4}}
    assert rows("extreme_length", **pair) == pytest.approx({"value": 0.5}, rel=1e-15)
    for name, slope in (("x", 0.6), ("y", -0.8)):
        assert rows.slopes("extreme_length", "v", name, **pair)["value"] == pytest.approx(slope, rel=1e-15)
        assert rows.slopes("extreme_length", "v", name, v={})["value"] == 0.0
    dish = {"R": 2.0, "sc": 0.3}
    assert rows("gap_at", par=dish, x={}) == {"s": 0.0, "g": 0.3}
    assert rows.slopes("gap_at", "par", "sc", par=dish, x={}) == {"s": 0.0, "g": 1.0}
    for tilt, slope in ((0.0, 0.0), (0.1, 2.0), (-0.1, -2.0)):
        found = rows.slopes("gap_at", "x", "theta", par=dish, x={"theta": tilt})
        assert found == pytest.approx({"s": slope, "g": -slope}, rel=1e-14)


def test_friction_is_scaled_to_the_size_of_another(rows: Kernels) -> None:
    """The size follows the other row alone, the direction the own one alone."""
    given = {"f": {"Y": 0.9, "Z": -1.2}, "m": {"Y": 0.6, "Z": 1.0}}
    found, most = rows("bounded_friction", **given), np.hypot(0.6, 1.0)
    assert found == pytest.approx({"Y": 0.6 * most, "Z": -0.8 * most}, rel=1e-15)
    across = {"Y": 0.8 * 0.8, "Z": 0.6 * 0.8}  # of a change along Y its part across the direction
    by_own = rows.slopes("bounded_friction", "f", "Y", **given)
    assert by_own == pytest.approx({name: value * most / 1.5 for name, value in across.items()}, rel=1e-14)
    by_most = rows.slopes("bounded_friction", "m", "Z", **given)
    assert by_most == pytest.approx({"Y": 0.6 / most, "Z": -0.8 / most}, rel=1e-14)


@mp.workdps(30)
def test_a_part_of_a_memory_solves_its_stage_formula(tmp_path: Path) -> None:
    """m = before + beta d with d = weight source - pace rate m, and what earlier stages and source contribute to it."""
    names = ("memory_past", "memory_gain", "memory_stage")
    kernels = Kernels(tmp_path, names, {"friction": "pvtd", "dimension": "planar"})
    numbers = {"rate": 3.0, "weight": 0.7, "pace": 2.5, "beta": 0.02, "before": 40.0, "source": 900.0}

    def stage(rate: mp.mpf, weight: mp.mpf, pace: mp.mpf, beta: mp.mpf, before: mp.mpf, source: mp.mpf) -> list[mp.mpf]:
        m = (before + beta * weight * source) / (1 + beta * pace * rate)
        return [m, weight * source - pace * rate * m]

    given = {
        "k": {"rate": numbers["rate"], "weight": numbers["weight"]},
        "par": {"plate_rate": numbers["pace"]},
        "h": {"beta": numbers["beta"]},
        "m": {"m": numbers["before"]},
        "c": {"source": numbers["source"]},
    }
    exact = {name: mp.mpf(value) for name, value in numbers.items()}
    m, d = stage(**exact)
    assert m == exact["before"] + exact["beta"] * d
    assert kernels("memory_stage", **given) == pytest.approx({"m": float(m), "d": float(d)}, rel=1e-14)
    past, gain = (kernels(name, **given) for name in ("memory_past", "memory_gain"))
    assert past["past"] + gain["gain"] * numbers["source"] == pytest.approx(float(m), rel=1e-14)
    inputs = {"pace": ("par", "plate_rate"), "beta": ("h", "beta"), "before": ("m", "m"), "source": ("c", "source")}
    for name, (alias, field) in inputs.items():
        step = exact[name] * mp.mpf("1e-9")
        low, high = (stage(**exact | {name: exact[name] + sign * step}) for sign in (-1, 1))
        slopes = kernels.slopes("memory_stage", alias, field, **given)
        want = [float((b - a) / (2 * step)) for a, b in zip(low, high, strict=True)]
        assert [slopes["m"], slopes["d"]] == pytest.approx(want, rel=1e-12), name
