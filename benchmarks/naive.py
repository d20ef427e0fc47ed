"""Errors of straightforward code in difficult cases: the third column of docs/robustness.md.

Each function is a short program as one would first write it, and returns its measured error as text. None uses msfp-gen.
`python benchmarks/naive.py` prints one line per case.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from quick import parser
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

Array = np.ndarray[Any, np.dtype[np.float64]]
G = 9.8


def tilt_by_arc_cosine() -> str:
    """(2.100) as printed: s = R acos(t . t')."""
    lost = {angle: np.arccos(np.cos(angle)) / angle - 1 for angle in (1e-6, 1e-8)}
    return f"acos: relative error of the tilt {lost[1e-6]:.0e} at 1e-6 rad; at 1e-8 rad the result is {1e-8 * (1 + lost[1e-8]):g}"


def direction_of_no_tilt() -> str:
    """(2.108) as printed at zero tilt, and friction along v/|v| at rest."""
    t = np.array([0.0, 0.0, 1.0])
    with np.errstate(invalid="ignore"):
        across = np.cross(t, t) / np.linalg.norm(np.cross(t, t))
    return f"contact direction 0/0: {across[0]}; one such number makes every later row {across[0]}"


def wall_met_by_an_event() -> str:
    """A wall that acts from the event of reaching it, for a body that starts inside it: there is no event."""
    met = solve_ivp(lambda t, y: [y[1], 0.0], (0, 1), [1e-3, 1.0], events=lambda t, y: y[0])
    return f"wall switched on by its event: {len(met.t_events[0])} events, the body is {met.y[0, -1]:.0f} m inside it"


def bounce_with_fixed_steps() -> str:
    """2 kg at 0.5 m/s against a spring, explicit steps of 0.1 ms: speed after over speed before, by stiffness."""
    factors = []
    for stiffness in (1e6, 1e8, 1e10):
        x, v, h = -1e-3, 0.5, 1e-4
        for _ in range(400):
            v -= h * stiffness * max(x, 0.0) / 2.0
            x += h * v
        factors.append(abs(v) / 0.5)
    return "fixed steps of 0.1 ms: rebound {:.2f}, {:.2f}, {:.0f} times the speed at 1e6, 1e8, 1e10 N/m".format(
        *factors
    )


def two_walls_one_event() -> str:
    """Two gaps close one microsecond after another; the step is cut at the first event and the next one takes 1 ms."""
    first, second, speed, step = 0.0, 1e-6, 1.0, 1e-3
    late = first + step - second
    return f"one event a step: the second wall is noticed {1e3 * speed * late:.1f} mm inside at 1 m/s"


def friction_of_velocity() -> str:
    """Friction mu N tanh(v/v0), v0 = 1 mm/s: a block held at half its friction for 60 s."""
    friction, held, v0 = 0.05 * G, 0.025 * G, 1e-3
    rest = brentq(lambda v: friction * np.tanh(v / v0) - held, 0.0, 0.1)
    return f"mu N tanh(v/1 mm/s): a block held at half its friction creeps {1e3 * rest * 60:.0f} mm in a minute"


def quasi_static_by_ode(rtol: float = 1e-2) -> str:
    """One massless pendulum on a spring as an ODE in sliding s and Y: solvers that report success, and worst error."""
    N, R, mu, dy, k, A, w = 112e3, 0.473, 0.03, 1e-4, 1e6, 0.025, 0.25

    def rates(t: float, y: Array) -> list[float]:
        push = k * A * w * np.cos(w * t)
        bent = 1 - y[1] ** 2 if y[1] * push > 0 else 1.0
        slip = push / (k + N / R + mu * N * bent / dy)
        return [slip, bent * slip / dy]

    runs = [
        solve_ivp(rates, (0, 25), [0.0, 0.0], m, rtol=rtol, atol=1e-2 * rtol) for m in ("RK45", "Radau", "BDF", "LSODA")
    ]
    wrong = [run for run in runs if run.success and np.abs(run.y[1]).max() > 1.1]
    worst = max(np.abs(run.y[1]).max() for run in runs)
    return f"quasi-static ODE, rtol {rtol:g}: {len(wrong)} of 4 solvers report success with |Y| up to {worst:.0f} (it is 1)"


def explicit_steps_for_a_stuck_slider() -> str:
    """A stuck slider of mass m on the stiffness mu N/d_y for one second: evaluations by RK45."""
    cost = {}
    for mass in (1.0, 1e-2):
        stiffness = 0.03 * 112e3 / 1e-4
        run = solve_ivp(
            lambda t, y, m=mass, c=stiffness: [y[1], np.sin(t) - c / m * y[0]],
            (0, 0.1),
            [0.0, 0.0],
            rtol=1e-3,
            atol=1e-12,
        )
        cost[mass] = 10 * run.nfev
    return f"RK45: {cost[1.0] / 1e3:.0f} thousand evaluations a second of motion at 1 kg, {cost[1e-2] / 1e3:.0f} thousand at 10 g"


def backward_euler_pendulum() -> str:
    """Ten periods of a frictionless swing with backward Euler, 100 steps a period: amplitude left."""
    h = 2 * np.pi / 100
    return (
        f"backward Euler, 100 steps a period: {100 * (1 + h * h) ** -500:.0f} % of a frictionless swing left after ten"
    )


def formulas_for_the_usual_order() -> str:
    """First slip by the formulas of the sliding regimes, in which the inner surfaces slide first, in section 4.2."""
    friction = (0.064, 0.168, 0.168, 0.064)
    return f"formulas with mu_2 = mu_3 < mu_1 put the first slip of section 4.2 at F/N = {friction[1]}; it is near {min(friction)}"


def two_accelerations() -> str:
    """A slider in a bowl of 0.1 m with its centre of mass at 0.08 m, mu = 0.5, Y = 1, theta = -0.3, moment -1 N m:
    (J + m r^2) a + m g r sin(theta) + 1 = rho |P(a)| has two roots, and a root finder returns either."""
    mass, arm, inertia, rho, tilt = 1.0, 0.02, 1e-4, 0.1 * 0.5 / np.hypot(1, 0.5), -0.3

    def moment(a: Array) -> Array:
        force: Array = mass * np.hypot(arm * a + G * np.sin(tilt), G * np.cos(tilt))
        return (inertia + mass * arm**2) * a + mass * G * arm * np.sin(tilt) + 1.0 - rho * force

    ends = [fsolve(moment, x, full_output=True) for x in (-1e4, 1e4)]
    good = [f"{x[0]:.0f}" for x, _, flag, _ in ends if flag == 1]
    return f"beyond regularity fsolve succeeds {len(good)} times: theta'' = {' and '.join(good)} rad/s^2"


def normal_force_as_a_length() -> str:
    """N = |P|/sqrt(1 + mu^2) of an interface under a tension of 5 kN."""
    pulled = np.array([0.0, 0.0, -5e3])
    return f"N = |P| under a pull of 5 kN: +{np.linalg.norm(pulled):.0f} N, and friction to match"


def rise_of_a_flat_bowl() -> str:
    """R - sqrt(R^2 - x^2) at x = 0.1 mm."""
    x = 1e-4
    lost = [abs((R - np.sqrt(R * R - x * x)) / (x * x / (R + np.sqrt(R * R - x * x))) - 1) for R in (1.0, 100.0, 1e4)]
    return f"R - sqrt(R^2 - x^2) at 0.1 mm: relative errors {lost[0]:.0e}, {lost[1]:.0e}, {lost[2]:.0e} at 1 m, 100 m, 10 km"


def euler_rates() -> str:
    """Rates of Euler angles at a given angular velocity near theta = pi/2."""
    return f"Euler rates 1/cos(theta): {1 / np.cos(1.57):.0f} times the angular velocity at 1.57 rad, and no message"


def velocity_jump_by_differences() -> str:
    """A base that starts at 0.2 m/s: peak acceleration by differences of its samples."""
    peaks = [0.2 / dt for dt in (0.01, 0.001)]
    return f"a jump of 0.2 m/s differenced: {peaks[0]:.0f} m/s^2 at 100 samples a second, {peaks[1]:.0f} at 1000"


def six_hundred_seconds_by_rk45() -> str:
    """A frictionless swing of 0.3 rad for 600 s with SciPy's defaults: energy at the end over energy at the start."""
    w2 = G / 1.0
    run = solve_ivp(lambda t, y: [y[1], -w2 * np.sin(y[0])], (0, 600), [0.3, 0.0])
    energy = run.y[1] ** 2 / 2 + w2 * (1 - np.cos(run.y[0]))
    return f"RK45 with its defaults, 600 s: {100 * energy[-1] / energy[0]:.0f} % of the energy, reported as success"


def pulse_between_steps() -> str:
    """An oscillator at rest with a pulse of 50 m/s^2 and 5 ms at 30 s of 60: response by an adaptive solver."""
    run = solve_ivp(lambda t, y: [y[1], -y[0] + 50.0 * (30.0 < t < 30.005)], (0, 60), [0.0, 0.0])
    return f"adaptive steps over a 5 ms pulse: response {np.abs(run.y[0]).max():g} m in {len(run.t) - 1} steps (it is 0.25 m)"


def unrolled_expressions() -> str:
    """Operations in the expanded acceleration equations of a chain of pendulums in SymPy, by number of bodies."""
    import sympy as sp

    t, counts = sp.Symbol("t"), []
    for n in (1, 2, 3, 4):
        q = [sp.Function(f"q{i}")(t) for i in range(n)]
        x, z, total = sp.Integer(0), sp.Integer(0), sp.Integer(0)
        for i in range(n):
            tilt = sum(q[: i + 1])
            x, z = x + sp.sin(tilt), z + sp.cos(tilt)
            total += (sp.diff(x, t) ** 2 + sp.diff(z, t) ** 2) / 2 - z
        counts.append(sum(sp.count_ops(sp.expand(sp.diff(total, r.diff(t), t) - sp.diff(total, r))) for r in q))
    return "expanded expressions of a planar chain: {} operations for 1, 2, 3, 4 bodies".format(
        ", ".join(str(c) for c in counts)
    )


CASES: list[Callable[[], str]] = [
    tilt_by_arc_cosine,
    direction_of_no_tilt,
    wall_met_by_an_event,
    two_walls_one_event,
    bounce_with_fixed_steps,
    friction_of_velocity,
    quasi_static_by_ode,
    explicit_steps_for_a_stuck_slider,
    backward_euler_pendulum,
    formulas_for_the_usual_order,
    two_accelerations,
    normal_force_as_a_length,
    rise_of_a_flat_bowl,
    euler_rates,
    velocity_jump_by_differences,
    six_hundred_seconds_by_rk45,
    pulse_between_steps,
    unrolled_expressions,
]


def main() -> None:
    """Print one line per case."""
    parser(__doc__).parse_args()
    for case in CASES:
        print(f"{case.__name__:36s} {case()}", flush=True)


if __name__ == "__main__":
    main()
