"""Closed bearings below masses, with and without uplift, at tight tolerances: prints two tables of docs/uplift.md.

Eleven random single articulated, double and triple pendulums below masses on vertical springs, N within 0.5 to 1.5 of
that at rest. Seats that are damped along their compression alone let sliders vibrate against the plate; the growth
rates are those of a model of three degrees of freedom, by `hand`: `python benchmarks/seats.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from auto_scenes import Chosen, a_bearing
from fuzz_scenes import GRAVITY, Draw, noise, reach
from quick import parser, pick

from msfp_gen import Effects, Motion, Scene, Solver, Top, simulate

SEED = 48
SCENES = pick(11, 1)
TOLERANCES = pick((1e-6, 1e-7, 1e-8), (1e-4,))
BEARINGS = ("single-articulated-fp", "double-fp", "fenz-tfp")
HEAVING = 2 * pi * 3.0  # [rad/s]
DAMPINGS = (0.0, 1.0, 10.0, 100.0)  # c of the seats [s/m]


def a_motion(draw: Draw, size: float) -> Motion:
    """A line, an orbit or noise, in half of the scenes with a heaving base."""
    rate = min(draw.decades((1.0, 4.0)), 0.8 / size)
    kind = draw.one(["line", "circle", "eight", "eight", "noise"])
    if kind == "circle":
        motion = Motion.circle(size, rate, cycles=1.0, lead_in=3.0)
    elif kind == "eight":
        motion = Motion.figure_eight(size, rate, cycles=1.0, lead_in=3.0)
    elif kind == "noise":
        motion = noise(draw, size, 0.0, True, 0.1)
    else:
        motion = Motion.harmonic(size, rate / (2 * pi), cycles=1.5)
    if draw.chance(0.5):
        return motion
    time = np.linspace(0.0, motion.duration, 1 + int(300 * motion.duration))
    heave = (
        draw.flat(0.05, 0.3) * GRAVITY / HEAVING**2 * np.sin(HEAVING * time) * np.sin(pi * time / motion.duration) ** 2
    )
    return motion + Motion.from_arrays(time, np.outer(heave, [0.0, 0.0, 1.0]))


def scene(number: int) -> Scene:
    """Scene `number`: a mass on a vertical spring of 12 to 20 Hz and 5 % damping above a bearing that stays closed."""
    draw = Draw(SEED, number)
    name = BEARINGS[number % len(BEARINGS)]
    bearing = a_bearing(draw, Chosen(name, "constant", "plastic"))
    load = draw.decades((200.0, 1000.0)) * GRAVITY * sum(body.mass for body in bearing.bodies)
    mass, rate = load / GRAVITY, 2 * pi * draw.flat(12.0, 20.0)
    top = Top.mass(mass, 0.3 * mass, 0.4, 10.0 * load, 0.05 * load, mass * rate**2, 0.1 * mass * rate)
    motion = a_motion(draw, draw.flat(0.1, 0.4) * reach(bearing))
    return Scene(bearing, motion, top, Effects(bouc_wen="plastic"), name=f"{name} {number}")


def peak(given: Scene, uplift: bool, rtol: float) -> tuple[float, int, np.ndarray]:
    """Peak horizontal force [N], number of steps, and N over that at rest, (T, n-1), of a run."""
    effects = replace(given.modelled, uplift=uplift)
    history = simulate(replace(given, effects=effects, solver=Solver(rtol=rtol, max_steps=2_000_000))).history
    assert not history.lift.any()
    forces = np.linalg.norm(history.top_force[:, :2], axis=1)
    return float(forces.max()), len(history.time) - 1, history.normal_force / history.normal_force[0]


def closed() -> None:
    """Print peak forces with uplift by tolerance, and what differs from the run without uplift."""
    cells = " | ".join(f"rtol {rtol:g} [kN]" for rtol in TOLERANCES)
    print(f"| scene | N over that at rest | without uplift [kN] | {cells} | most apart | steps |")
    print("|---" * (5 + len(TOLERANCES)) + "|")
    for number in range(SCENES):
        given = scene(number)
        plain, _, _ = peak(given, False, TOLERANCES[-1])
        forces, steps, ratios = zip(*(peak(given, True, rtol) for rtol in TOLERANCES), strict=True)
        apart = np.ptp([plain, *forces]) / plain
        print(
            f"| {given.name} | {ratios[-1].min():.2f} to {ratios[-1].max():.2f} | {plain / 1e3:.2f} | "
            + " | ".join(f"{force / 1e3:.2f}" for force in forces)
            + f" | {apart:.2%} | {steps[-1]} |",
            flush=True,
        )


@dataclass(frozen=True)
class Seats:
    """A slider of mass m between two seats of stiffness k, below a plate that is free to rise; SI units.

    Lateral force of the slider over N: `own` by the lower surface, which follows N there, `other` by the upper one. The
    resultant at the upper seat is inclined by their sum. isotropic: the damper acts in every direction, not along the
    resultant alone.
    """

    m: float
    plate: float
    k: float
    N: float
    own: float
    other: float
    c: float
    isotropic: bool

    def accelerations(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Of the slider sideways and upward, and of the plate upward, at displacements and rates from sliding."""
        n = np.array([self.own + self.other, 1.0])
        upper, rate = np.array([x[0], x[1] - x[2]]), np.array([v[0], v[1] - v[2]])
        damped = rate if self.isotropic else n * (n @ rate)
        force = self.k * upper + self.c * self.N * damped
        below = -self.k * x[1] - self.c * self.N * v[1]
        side = self.own * below + self.other * (n @ force) - force[0]
        return np.array([side / self.m, (below - force[1]) / self.m, force[1] / self.plate])

    def modes(self) -> np.ndarray:
        """Eigenvalues [1/s]."""
        zero, unit = np.zeros(3), np.eye(3)
        lower = [self.accelerations(e, zero) for e in unit] + [self.accelerations(zero, e) for e in unit]
        return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((3, 3)), unit]), np.transpose(lower)]))


def hand() -> None:
    """Print the growth rate of the lateral vibration of the slider of a single articulated pendulum of 48 t."""
    print("\n| damped | " + " | ".join(f"c = {c:g} s/m" for c in DAMPINGS) + " |")
    print("|---" * (1 + len(DAMPINGS)) + "|")
    for isotropic, name in ((False, "along the compression"), (True, "in every direction")):
        cells = []
        for c in DAMPINGS:
            modes = Seats(76.2, 180.7, 2.04e10, 4.73e5, 0.0696, 0.0042, c, isotropic).modes()
            modes = modes[np.argsort(modes.real)]
            cells.append(f"{modes[-1].real:.1f} 1/s at {abs(modes[-1].imag) / (2 * pi):.0f} Hz")
        print(f"| {name} | " + " | ".join(cells) + " |")


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    closed()
    hand()


if __name__ == "__main__":
    main()
