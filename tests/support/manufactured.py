"""Manufactured solutions: a motion is prescribed, and the loads that cause it follow from the emitted equations.

Angles q(t) of all bodies (with uplift also their separations) are given functions. At every time the residual of the
condensed equations at q, its rates and its accelerations is a number of moments and forces that are missing; loads on
the top plate and accelerations of the base are found that supply them. Both are inputs of any run. Friction, heat and
the foot of a sprung mass have rates of their own, which are integrated along the given motion to 1e-12 (DOP853). A run
with these inputs then has q(t) as its exact solution, and the error of a method is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import BSpline, make_interp_spline

from msfp_gen import Bearing, Effects, Top, build_model
from msfp_gen.model.model import Model
from msfp_gen.motions.piecewise import ORDER
from msfp_gen.scene import top as scene_top
from msfp_gen.scene.friction_parameters import law_parameters
from msfp_gen.scene.top import MassTop, is_sprung, load_values
from msfp_gen.specification.friction_laws import HEAT_KERNEL, PLATE_KERNEL
from support import Array

LOAD = 1e5  # around which the sources are found, downwards [N]
RESOLVED = 8  # steps between two of them in a run that others are compared with
KNOTS = 1921  # of the inputs in a run: their pieces are within 1e-12 of them
SOURCES = ("F1", "F2", "F3", "M1", "M2", "M3", "a1", "a2", "a3")  # loads on the top plate, accelerations of the base


@dataclass(frozen=True)
class Path:
    """Functions c + s t + A sin(w t + p) of one shape, with two derivatives; every field broadcasts to it."""

    start: Any = 0.0
    slope: Any = 0.0
    amplitude: Any = 0.0
    frequency: Any = 2 * np.pi
    phase: Any = 0.0

    def __call__(self, t: float) -> Array:
        """Value, rate and second derivative, stacked first."""
        a, w = np.asarray(self.amplitude, dtype=float), np.asarray(self.frequency, dtype=float)
        angle = w * t + self.phase
        value = self.start + np.asarray(self.slope) * t + a * np.sin(angle)
        return np.stack(np.broadcast_arrays(value, self.slope + a * w * np.cos(angle), -a * w**2 * np.sin(angle)))


@dataclass(frozen=True)
class Case:
    """One manufactured solution.

    Attributes:
        path: of the coordinates, shape (n-1, 3 or 6) [rad], [m].
        sources: which inputs supply what is missing, one for each coordinate.
        friction: Y, Z of all surfaces at the start, as a share along the slip.
        base, support: paths of psi, theta, phi of the base and of psi, theta of the support of the top plate [rad].
        load: force and moment around which the sources are found, shape (6,) [N], [N m].
        duration: of the run [s].
        steps: numbers of steps of the runs, by method.
    """

    name: str
    bearing: Bearing
    effects: Effects
    path: Path
    sources: tuple[str, ...]
    top: Top = field(default_factory=lambda: Top.prescribed((0.0, 0.0, 0.0)))
    friction: float = 0.2
    base: Path = field(default_factory=lambda: Path(np.zeros(3)))
    support: Path | None = None
    load: tuple[float, ...] = (0.0, 0.0, -LOAD, 0.0, 0.0, 0.0)
    duration: float = 0.5
    steps: dict[str, tuple[int, ...]] = field(default_factory=dict)

    @cached_property
    def model(self) -> Model:
        return build_model(self.bearing.layout, self.effects)

    @cached_property
    def stack(self) -> Any:
        return self.model.stack(self.bearing, self.top)

    @property
    def count(self) -> int:
        return self.bearing.layout.surfaces

    def coordinates(self, t: float) -> Array:
        """Coordinates, rates and accelerations, shape (3, n-1, 3 or 6); without inertia accelerations are zero."""
        shape = (3, self.count, self.model.extension.COORDINATES)
        found = np.array(np.broadcast_to(self.path(t), shape))
        if self.effects.sliders == "massless":
            found[2] = 0.0
        return found


class State:
    """Parts of what is integrated along the motion: Y, Z; foot of the mass; heat; displacement of the base."""

    def __init__(self, case: Case, y: Array) -> None:
        b, law = case.count, case.effects.law
        self.heated = law is not None and law.depends_on_temperature
        sizes = (2 * b, 2 if is_sprung(case.top) else 0, heat_kernel(case)[0].size if self.heated else 0, 3, 3)
        parts = np.split(y, np.cumsum(sizes)[:-1])
        self.f, self.foot = np.ascontiguousarray(parts[0].reshape(b, 2)), parts[1].copy()
        self.heat = parts[2].reshape(b, -1)
        self.place, self.speed = parts[3], parts[4]

    @property
    def more(self) -> dict[str, Array]:
        """Keywords of an evaluation."""
        given = {"foot": self.foot} if len(self.foot) else {}
        return {**given, "memory": np.ascontiguousarray(self.heat.sum(axis=1))} if self.heated else given


def missing(case: Case, t: float, state: State, sources: Array) -> tuple[Array, tuple[Any, ...]]:
    """Residual at the given motion with these sources, and the arguments of an evaluation there."""
    given = dict(zip(case.sources, sources, strict=True))
    base = np.zeros((3, 6))
    base[:, 3:] = case.base(t)
    base[0, :3], base[1, :3] = state.place, state.speed
    base[2, :3] = [given.get(f"a{i}", 0.0) for i in (1, 2, 3)]
    load = np.array(case.load) + load_values(case.top)
    load[:3] += [given.get(f"F{i}", 0.0) for i in (1, 2, 3)]
    load[3:] += [given.get(f"M{i}", 0.0) for i in (1, 2, 3)]
    if case.support is not None:
        turned = np.zeros((2, 6))
        turned[:, :2] = case.support(t)[:2]
        load = np.concatenate([load, turned.ravel()])
    arguments = (*np.ascontiguousarray(case.coordinates(t)), state.f, base, load)
    status, residual, *_ = case.stack.condensed(*arguments, 0.0, 0.0, 0.0, 0.0, **state.more)
    assert status == "ok", f"{case.name}: {status} at {t:.4f} s"
    return residual, arguments


class Sources:
    """The sources of a case along its motion: Newton's method from those of the last time, with its tangent."""

    def __init__(self, case: Case) -> None:
        self.case, self.inverse = case, None
        self.scale = np.array([{"F": 1e4, "M": 5e3, "a": 1.0}[name[0]] for name in case.sources])
        self.found = np.zeros(len(self.scale))

    def at(self, t: float, state: State) -> Array:
        """Sources with which nothing is missing."""

        def residual(x: Array) -> Array:
            return missing(self.case, t, state, self.scale * x)[0]

        x, left = self.found, residual(self.found)
        for _ in range(50):
            if np.abs(left).max() < 3e-15 * LOAD:
                break
            if self.inverse is None:
                units = 1e-3 * np.eye(len(x))
                self.inverse = np.linalg.inv(np.array([residual(x + unit) - left for unit in units]).T / 1e-3)
            trial = x - self.inverse @ left
            last, left = left, residual(trial)
            if np.abs(left).max() > 0.1 * np.abs(last).max():
                if np.abs(last).max() < 1e-12 * LOAD:  # rounding
                    break
                self.inverse = None
            x = trial
        else:
            raise ArithmeticError(f"{self.case.name}: no sources at {t:.4f} s")
        self.found = x
        return self.scale * x


def initial(case: Case) -> Array:
    """Friction along the slip, the foot and the base at rest, heat that is slow to change at zero.

    The fast parts of the heat are those that the flux sustains, so that they begin smoothly too.
    """
    y = np.zeros(2 * case.count + 2 * is_sprung(case.top) + 6)
    law = case.effects.law
    if law is not None and law.depends_on_temperature:
        y = np.zeros(len(y) + heat_kernel(case)[0].size)
    state = State(case, y)
    sources = np.zeros(len(case.sources))
    for _ in range(4):  # the direction of the slip depends on the friction, the heat on both
        sources = sources if is_sprung(case.top) else Sources(case).at(0.0, state)
        row = observed(case, 0.0, state, sources)[0]
        size = np.linalg.norm(row["slip"], axis=1, keepdims=True)
        along = row["slip"] / np.where(size > 0, size, 1.0)
        state.f = np.ascontiguousarray(case.friction * along)
        if state.heated:
            rate, weight = heat_kernel(case)
            flux = np.array([heat_flux(case, row, index) for index in range(case.count)])
            state.heat = np.divide(weight, rate, where=rate > 50, out=np.zeros_like(rate)) * flux[:, None]
    y[: 2 * case.count] = state.f.ravel()
    if state.heated:
        y[-6 - state.heat.size : -6] = state.heat.ravel()
    if is_sprung(case.top):
        top: Any = case.top
        state.foot[:] = 0.0
        height = observed(case, 0.0, state, sources)[0]["top"][2]
        y[2 * case.count] = height - scene_top.sprung_mass(top) * case.bearing.gravity / top.vertical_stiffness
    return y


def observed(case: Case, t: float, state: State, sources: Array) -> tuple[dict[str, Array], Array]:
    """The row of the motion at a time, and the friction rates."""
    arguments = missing(case, t, state, sources)[1]
    row, _, rates, _ = case.stack.observe(*arguments, **state.more)
    return case.model.unpack(row), rates


def rates(case: Case, supply: Sources, t: float, y: Array) -> Array:
    """Rates of what is integrated."""
    state = State(case, y)
    sources = supply.at(t, state)
    row, friction = observed(case, t, state, sources)
    given = dict(zip(case.sources, sources, strict=True))
    out = [friction.ravel()]
    if is_sprung(case.top):  # the end of the spring of a rig does not move
        moves = isinstance(case.top, MassTop)
        out.append(np.array([state.foot[1], foot_acceleration(case, t, row) if moves else 0.0]))
    if state.heated:
        rate, weight = heat_kernel(case)
        flux = np.array([heat_flux(case, row, index) for index in range(case.count)])
        out.append((weight * flux[:, None] - rate * state.heat).ravel())
    acceleration = np.array([given.get(f"a{i}", 0.0) for i in (1, 2, 3)])
    return np.concatenate([*out, state.speed, acceleration])


def foot_acceleration(case: Case, t: float, row: dict[str, Array]) -> float:
    """m (y'' + h t_3'' E3 + g) = S (docs/model.md), of a planar stack: t_3 E3 is the cosine of the sum of the tilts.

    The force on the support is S less the load.
    """
    top: Any = case.top
    assert case.effects.dimension == "planar"
    tilt, rate, bend = case.coordinates(t)[:, :, 1].sum(axis=1) + case.base(t)[:, 1]
    cosine = -np.sin(tilt) * bend - np.cos(tilt) * rate**2
    return float(row["top_force"][2] + case.load[2]) / top.mass - case.bearing.gravity - top.height * cosine


def heat_kernel(case: Case) -> tuple[Array, Array]:
    """Rates [1/s] and weights [s^-1/2] of the parts of the heat of every surface, shape (n-1, parts).

    Those of a plate are functions of the time over d^2/D (docs/friction.md).
    """
    law = case.effects.law
    assert law is not None
    if case.effects.friction != "pvtd":
        rate, weight = np.array(HEAT_KERNEL).T
        return np.tile(rate, (case.count, 1)), np.tile(weight, (case.count, 1))
    every = [law_parameters(law, case.bearing, index) for index in range(case.count)]
    pace = np.array([[par["diffusivity"] / par["plate_thickness"] ** 2] for par in every])
    rate, weight = np.array(PLATE_KERNEL).T
    return pace * rate, np.sqrt(pace) * weight


def heat_flux(case: Case, row: dict[str, Array], index: int) -> float:
    """sqrt(D/pi)/k mu p v of a surface whose centre is covered, v as of docs/friction.md."""
    law = case.effects.law
    assert law is not None
    par = law_parameters(law, case.bearing, index)
    f, slip = row["f"][index], row["slip"][index]
    v = (f @ f) * max(f @ slip, 0.0)
    pressure = row["normal"][index] / (np.pi * par["patch_radius"] ** 2)
    return float(np.sqrt(par["diffusivity"] / np.pi) / par["conductivity"] * row["mu"][index] * pressure * v)


@dataclass(frozen=True)
class Solution:
    """Inputs of a run and its exact states.

    motion, load, support: knots and coefficients. start: keywords of the run. time: (KNOTS,) [s], and there q, f and,
    of a law with heat, the temperature above that at the start: (KNOTS, n-1, 3 or 6), (KNOTS, n-1, 2), (KNOTS, n-1).
    """

    motion: tuple[Array, Array]
    load: tuple[Array, Array]
    support: tuple[Array, Array] | None
    start: dict[str, Any]
    time: Array
    states: dict[str, Array]


def spline(t: Array, channels: Array, degree: int) -> BSpline:
    return make_interp_spline(t, channels, k=degree)


def coefficients(poly: BSpline, t: Array, channels: int) -> Array:
    """(pieces, 6, 6) of the channels of a spline, ascending powers: its Taylor series at each knot."""
    out = np.zeros((len(t) - 1, 6, ORDER))
    factorial = 1.0
    for power in range(ORDER):
        factorial *= max(power, 1)
        # the highest derivative jumps at a knot of the spline; the middle of a piece belongs to no other
        at = t[:-1] if power < ORDER - 1 else (t[:-1] + t[1:]) / 2
        out[:, :channels, power] = poly(at, nu=power) / factorial
    return out


def solve(case: Case) -> Solution:
    """Inputs that cause the motion of a case."""
    t, y0, supply = np.linspace(0.0, case.duration, KNOTS), initial(case), Sources(case)
    heated = State(case, y0).heated  # rates of up to 6000 per second: the limit of stability
    span, longest = (0.0, case.duration), 5e-4 if heated else case.duration / 40
    found = solve_ivp(
        lambda at, y: rates(case, supply, at, y), span, y0, "DOP853", t, rtol=1e-12, atol=1e-13, max_step=longest
    )
    assert found.success, found.message
    along = [State(case, y) for y in found.y.T]
    values = np.array([supply.at(at, state) for at, state in zip(t, along, strict=True)])
    given = dict(zip(case.sources, values.T, strict=True))
    zero = np.zeros(len(t))
    constant = np.array(case.load) + load_values(case.top)
    load = spline(t, np.column_stack([given.get(name, zero) + constant[i] for i, name in enumerate(SOURCES[:6])]), 5)
    base = spline(t, np.column_stack([given.get(name, zero) for name in SOURCES[6:]]), 3).antiderivative(2)
    angles = spline(t, np.array([case.base(at)[0] for at in t]), 5)
    motion = coefficients(base, t, 3)
    motion[:, 3:] = coefficients(angles, t, 3)[:, :3]
    support = None
    if case.support is not None:
        support = (t, coefficients(spline(t, np.array([case.support(at)[0][:2] for at in t]), 5), t, 2))
    q, v, _ = case.coordinates(0.0)
    start: dict[str, Any] = {"q": q, "v": v, "f": along[0].f}
    states = {"q": np.array([case.coordinates(at)[0] for at in t]), "f": np.array([state.f for state in along])}
    if is_sprung(case.top):
        start["foot"] = along[0].foot
    if along[0].heated:
        start["memory"] = np.ascontiguousarray(along[0].heat)
        states["rise"] = np.array([state.heat.sum(axis=1) for state in along])
    return Solution((t, motion), (t, coefficients(load, t, 6)), support, start, t, states)


def run(case: Case, solution: Solution, method: str, steps: int, rtol: float, **options: Any) -> Any:
    """The compiled run in steps of one length."""
    step = case.duration / steps
    start = {**solution.start, **options}
    q, v, f = (np.ascontiguousarray(start.pop(name)) for name in "qvf")
    if solution.support is not None:
        start["support_knots"], start["support_coefficients"] = solution.support
    made = case.model.extension.Run(
        case.stack, *solution.motion, *solution.load, np.zeros(0), q, v, f, method=method, rtol=rtol, atol_angle=1e6,
        max_step=step * (1 + 1e-12), first_step=step, duration=case.duration, **start,
    )  # fmt: skip
    while made.advance():
        pass
    return made


def errors(case: Case, solution: Solution, made: Any, last: bool = False) -> dict[str, float]:
    """RMS over the steps of the largest error: of angles, separations and T over their largest value, of Y and Z.

    last: at the end alone, for runs whose steps end at events.
    """
    assert made.status[0] == "ok", (case.name, made.status)
    rows = case.model.unpack(made.rows[-1:] if last else made.rows)
    at = np.rint(rows["time"] / solution.time[1]).astype(int)
    assert np.abs(rows["time"] - solution.time[at]).max() < 1e-9
    states = dict(solution.states)
    parts = {"angles": rows["q"][..., :3], "friction": rows["f"]}
    if case.effects.uplift:
        parts["separation"] = rows["q"][..., 3:]
    if "rise" in states:
        law, surfaces = case.effects.law, range(case.count)
        assert law is not None
        start = [law_parameters(law, case.bearing, index)["start_temperature"] for index in surfaces]
        parts["temperature"] = rows["temperature"] - start
    q = states["q"]
    exact = {"angles": q[..., :3], "friction": states["f"], "separation": q[..., 3:], "temperature": states.get("rise")}
    found = {}
    for name, got in parts.items():
        true = exact[name]
        off = np.abs(got - true[at]).reshape(len(at), -1).max(axis=1)
        found[name] = float(np.sqrt(np.mean(off**2)) / np.abs(true).max())
    return found


TOLERANCES = 10.0 ** np.arange(-11, -2)


def fixed_steps(
    case: Case, solution: Solution, method: str, counts: tuple[int, ...], last: bool = False, **options: Any
) -> list[dict[str, float]]:
    """Errors of runs with these numbers of steps.

    The tolerance, which Newton's method keeps too, is the least that permits the steps. last: see `errors`; then events
    may add steps.
    """
    for rtol in TOLERANCES:
        made = [run(case, solution, method, steps, rtol, **options) for steps in counts]
        as_asked = [each.counts["steps"] - n for each, n in zip(made, counts, strict=True)]
        if not any(each.counts["rejected_steps"] for each in made) and (last or not any(as_asked)):
            return [errors(case, solution, each, last) for each in made]
    raise AssertionError(f"{case.name}, {method}: steps were rejected at every tolerance")


def orders(found: list[dict[str, float]], counts: tuple[int, ...]) -> dict[str, float]:
    """Observed orders by quantity: the slope of the error over the length of a step, by least squares."""
    steps = np.log(np.array(counts))
    return {name: -float(np.polyfit(steps, np.log([each[name] for each in found]), 1)[0]) for name in found[0]}


def resolved(case: Case, push: Callable[[Array], Array]) -> Solution:
    """What `solve` returns, of a motion that is not given: that of a run in very short steps of `esdirk4`.

    Orders against it verify the methods but not the equations. The path of the case gives the start. push: factor of
    the load of the case over time [s]; it is smooth.
    """
    t = np.linspace(0.0, case.duration, KNOTS)
    load = push(t)[:, None] * np.array(case.load) + load_values(case.top)
    still = np.array([0.0, case.duration]), np.zeros((1, 6, ORDER))
    q, v, _ = case.coordinates(0.0)
    start = {"q": q, "v": v, "f": np.zeros((case.count, 2))}
    solution = Solution(still, (t, coefficients(spline(t, load, 5), t, 6)), None, start, t, {})
    for rtol in TOLERANCES:
        made = run(case, solution, "esdirk4", RESOLVED * (KNOTS - 1), rtol)
        if not made.counts["rejected_steps"]:
            break
    rows = case.model.unpack(made.rows)
    at = np.searchsorted(rows["time"], t - 1e-9 * case.duration)
    return replace(solution, states={name: rows[name][at] for name in "qf"})
