"""The whole simulation in plain NumPy: PEER Report 2017/07 for any stack, to be read in an hour. It is short, and slow.

`balances` states the equations of the report at one instant, with their numbers. Newton's method solves them, and two
integrations use it: the implicit midpoint rule, and the report's method of Dormand and Prince. Bodies do not spin,
friction is constant, surfaces stay closed. Bodies or surfaces are on the axis before the last, states on earlier axes.
"""

from dataclasses import replace
from fractions import Fraction
from functools import partial
from types import SimpleNamespace

import numpy as np

E = np.eye(3)


def cross(a, b):
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def rotate(psi, theta, t):
    """(2.3)-(2.6): the basis t, rows t_1, t_2, t_3, turned by psi about t_1 and then by theta about the new t_2."""
    c, s, t1, t2, t3 = np.cos(psi)[..., None], np.sin(psi)[..., None], *np.moveaxis(t, -2, 0)
    t2, t3 = c * t2 + s * t3, c * t3 - s * t2
    c, s = np.cos(theta)[..., None], np.sin(theta)[..., None]
    return np.stack(np.broadcast_arrays(c * t1 - s * t3, t2, s * t1 + c * t3), axis=-2)


def kinematics(b, base, q, v, a):
    """Body by body: basis, angular velocity, sphere centre above (3.4), (3.8), (3.11), acceleration of its mass.

    base: u_g and its two derivatives (3, 3). q, v, a: psi, theta of bodies 2..n and their derivatives (..., n-1, 2).
    """
    t, w, dw, (r, dr, ddr) = E, np.zeros(3), np.zeros(3), base
    r = r + b.first * E[2]
    bodies = [{"t": t, "w": w, "dw": dw, "r": r, "dr": dr, "ddr": ddr, "mass": ddr}]
    for k in range(b.m):
        (psi, theta), rates, second = (np.moveaxis(x[..., k, :], -1, 0) for x in (q, v, a))
        psi1, theta1, psi2, theta2 = (x[..., None] for x in (*rates, *second))
        below, t1, t = w, t[..., 0, :], rotate(psi, theta, t)
        t2, t3 = t[..., 1, :], t[..., 2, :]
        w = below + psi1 * t1 + theta1 * t2  # (3.12)
        dw = dw + psi2 * t1 + psi1 * cross(below, t1) + theta2 * t2 + theta1 * cross(w, t2)  # with (2.36)
        dt3 = cross(w, t3)
        ddt3 = cross(dw, t3) + cross(w, dt3)
        mass = ddr + b.c[k] * ddt3  # acceleration of the centre of mass (3.6), (3.10)
        r, dr, ddr = r + b.e[k] * t3, dr + b.e[k] * dt3, ddr + b.e[k] * ddt3
        bodies.append({"t": t, "w": w, "dw": dw, "r": r, "dr": dr, "ddr": ddr, "mass": mass})
    return bodies


def contacts(b, t, w, h, angles, N):
    """Force and moment about the sphere centre of every surface on the body above it, and dh/dt of h = (Y, Z)."""
    t1, t2, t3 = np.moveaxis(rotate(angles[..., 0], angles[..., 1], t[..., :-1, :, :]), -2, 0)  # (3.13)
    arm = -b.sign * b.radius * t3  # from the sphere centre to the contact point (3.14)
    velocity = cross(w[..., 1:, :] - w[..., :-1, :], arm)  # (3.19)
    slip = np.concatenate([dot(velocity, t1), dot(velocity, t2)], axis=-1)
    dh = (slip - h * dot(np.where((h * slip).real > 0, h, 0.0), slip)) / b.yield_displacement  # Bouc-Wen (3.18)
    g = h + b.contact_damping * dh  # no damping in the report
    friction = -b.friction * N[..., None] * (g[..., :1] * t1 + g[..., 1:] * t2)  # (3.16), (3.17)
    force, moment = N[..., None] * t3 + friction, cross(arm, friction)  # with (3.15)
    lower, upper, up = t[..., :-1, 2, :], t[..., 1:, 2, :], b.sign > 0
    cosine = dot(lower, upper)
    met = cosine.real < np.cos(b.capacity / b.radius)
    if met.any():  # rims: (3.20)-(3.25)
        sine = np.sqrt(np.where(met, 1 - cosine**2, 1.0))
        gap = b.capacity - b.radius * np.arctan(sine / cosine)  # (3.20), (3.21)
        turn = dot(cross(w[..., :-1, :], lower), upper) + dot(lower, cross(w[..., 1:, :], upper))
        size = b.rim_stiffness * gap + b.rim_damping * b.radius * turn / sine  # (3.23) with (2.102)
        slider, other = np.where(up, upper, lower), np.where(up, lower, upper)
        rim = np.where(met & (size.real < 0), size * (other - cosine * slider) / sine, 0.0)  # (3.22), (3.24)
        force, moment = force + rim, moment - cross(b.sign * (b.radius - b.offset) * slider, rim)  # (3.25)
    return force, moment, dh


def turning(inertia, t3, w, dw):
    """J dw/dt + w x J w, with J = l_1 1 + (l_3 - l_1) t_3 t_3 (2.118)."""
    first, more = inertia[..., :1], inertia[..., 1:] - inertia[..., :1]
    return first * dw + more * (dot(t3, dw) * t3 + dot(t3, w) * cross(w, t3))


def top(b, body):
    """Force and moment about r_nn of the bearing on what is above it: springs and dampers of a rig, a mass, a load."""
    rig, t3, w, dw = b.rig, body["t"][..., 2, :], body["w"], body["dw"]
    inertia = rig.mass * (body["ddr"] + rig.height * (cross(dw, t3) + cross(w, cross(w, t3))) + b.gravity * E[2])
    springs = (rig.stiffness * (body["r"] - b.anchor) + rig.damping * body["dr"]) * [1, 1, 0]
    moment = rig.rotational_stiffness * cross(E[2], t3) + rig.rotational_damping * w + rig.height * cross(t3, inertia)
    return inertia + springs + rig.axial_load * E[2], moment + turning(np.ones(2) * rig.inertia, t3, w, dw)


def balances(b, base, q, v, h, x):
    """What is left of the balances (3.26)-(3.29), (..., 5m) [N], [N m], and dh/dt (..., 2m), with m = n - 1.

    x: the unknowns (2.119): psi'', theta'' body by body, psi~, theta~ surface by surface, N; (..., 5m).
    """
    a, angles = (y.reshape(*y.shape[:-1], b.m, 2) for y in (x[..., : 2 * b.m], x[..., 2 * b.m : 4 * b.m]))
    bodies = kinematics(b, base, q, v, a)
    stack = {name: np.broadcast_arrays(*(body[name] for body in bodies)) for name in ("t", "w", "dw", "mass")}
    t, w, dw, mass = (np.stack(parts, axis=-3 if name == "t" else -2) for name, parts in stack.items())
    P, M, dh = contacts(b, t, w, h, angles, x[..., 4 * b.m : 5 * b.m])
    above = zip((P, M), top(b, bodies[-1]), strict=True)
    P_above, M_above = (np.concatenate([y[..., 1:, :], z[..., None, :]], axis=-2) for y, z in above)
    t3, lower, upper = t[..., 1:, 2, :], b.c * P, (b.e - b.c) * P_above
    linear = b.masses * (mass[..., 1:, :] + b.gravity * E[2]) - P + P_above  # (3.26), (3.28)
    angular = turning(b.inertia, t3, w[..., 1:, :], dw[..., 1:, :]) - M + M_above + cross(t3, lower + upper)
    moments = (t[..., 1:, :2, :] * angular[..., None, :]).sum(-1)  # (3.27), (3.29) along t_1, t_2; t_3: spin is locked
    linear, moments, dh = (y.reshape(*y.shape[:-2], -1) for y in (linear, moments, dh))
    return np.concatenate([linear, moments], axis=-1), dh


def newton(function, x, tolerance):
    """A zero of a function; steps along the imaginary axis give its value and its Jacobian in one call."""
    for _ in range(50):
        found = function(x + 1e-30j * np.eye(x.size))
        if np.abs(found[0].real).max() < tolerance:
            return x
        x = x - np.linalg.solve(found.imag.T / 1e-30, found[0].real)
    raise ArithmeticError(f"no convergence: {np.abs(found[0].real).max():.3g} N")


def midpoint(b, base, end, step):
    """The implicit midpoint rule: times, and the force on the top plate in the middle of every step."""
    m, y, times, forces = b.m, np.zeros((3, b.m, 2)), (np.arange(round(end / step)) + 0.5) * step, []
    x = np.append(b.rest, np.zeros(2 * m))

    def middle(x):  # beside the unknowns x has the rates dh/dt
        a, dh = (z.reshape(*z.shape[:-1], m, 2) for z in (x[..., : 2 * m], x[..., 5 * m :]))
        return y[0] + step / 2 * (v := y[1] + step / 2 * a), v, y[2] + step / 2 * dh, a, dh

    def left(x):
        found, dh = balances(b, base(t), *middle(x)[:3], x)
        return np.concatenate([found, (x[..., 5 * m :] - dh) * step * b.rest[-1]], axis=-1)

    for t in times:
        x = newton(left, x, 1e-7 * b.rest[-1])
        q, v, _, a, dh = middle(x)
        forces.append(top(b, kinematics(b, base(t), q, v, a)[-1])[0])
        y = y + step * np.array([v, a, dh])
    return times, np.array(forces)


DORMAND_PRINCE = """1/5; 3/40 9/40; 44/45 -56/15 32/9; 19372/6561 -25360/2187 64448/6561 -212/729; 9017/3168 -355/33
    46732/5247 49/176 -5103/18656; 35/384 0 500/1113 125/192 -2187/6784 11/84"""
STAGES = [np.array([float(Fraction(weight)) for weight in row.split()]) for row in DORMAND_PRINCE.split(";")]
ERROR = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


def dormand_prince(b, base, end, rtol=1e-5):
    """The report's explicit method with step control: time, and force on the top plate, after every step."""
    m, x, y, t, step, rows = b.m, b.rest, np.zeros((3, b.m, 2)), 0.0, 1e-5, []
    while t < end:
        slopes = []
        for row in (np.zeros(0), *STAGES):
            state = y + step * sum((w * slope for w, slope in zip(row, slopes, strict=True)), np.zeros_like(y))
            left = partial(balances, b, base(t + step * row.sum()), *state)
            x = newton(lambda x, left=left: left(x)[0], x, 1e-7 * b.rest[-1])
            slopes.append(np.array([state[1], x[: 2 * m].reshape(m, 2), left(x)[1].reshape(m, 2)]))
        error = np.abs(step * np.tensordot(ERROR, slopes, 1)).max() / rtol
        if error < 1:  # the last stage is the end of the step
            t, y = t + step, state
            rows.append([t, *top(b, kinematics(b, base(t), *y[:2], slopes[-1][1])[-1])[0]])
        step = min(step * min(5.0, 0.9 * (error + 1e-9) ** -0.2), max(end - t, 1e-12))
    return np.array(rows)


# ---- Numbers of a bearing of msfp_gen, and what its compiled run gives. Nothing above needs this.
from msfp_gen import Top, load_scene, simulate  # noqa: E402


def values_of(bearing, top, anchor=(0.0, 0.0)):
    """The numbers above of a `Bearing` and a `Top` without vertical spring; its springs are fixed at `anchor` [m]."""
    of = {name: values[:, None] for name, values in bearing.arrays().items() if name != "gravity"}
    m, sign = bearing.layout.surfaces, np.repeat([[1.0], [-1.0]], [bearing.layout.m, bearing.layout.p], axis=0)
    height, z, R, above = of["height"][1:], of["centroid"][1:], sign * of["radius"], np.cumsum(of["mass"][:0:-1])[::-1]
    rig = SimpleNamespace(**vars(Top.rig(0.0, 0.0)) | dict.fromkeys(("mass", "inertia", "height"), 0.0) | vars(top))
    return SimpleNamespace(
        **of, m=m, gravity=bearing.gravity, sign=sign, masses=of["mass"][1:], first=of["height"][0] + R[0],
        c=np.where(sign > 0, z, height - z) - R, e=height - R + np.append(R[1:], [[0.0]], axis=0),  # (3.2)-(3.11)
        offset=of["rim_offset"][np.arange(m) + (sign[:, 0] > 0)],  # of the body that meets the rim
        inertia=np.concatenate([of["inertia_transverse"], of["inertia_axial"]], axis=1)[1:], rig=rig,
        rest=np.append(np.zeros(4 * m), rig.axial_load + bearing.gravity * (rig.mass + above)),
        anchor=np.array([*anchor, 0.0]),  # rest: the unknowns of a centred bearing, N is the weight above
    )  # fmt: skip


def compare(scene, end, step):
    """Times, and forces [N] on the top plate of the loop and of `simulate`."""
    history = simulate(replace(scene, duration=end, output_step=step / 2)).history
    base = lambda t: np.array([scene.motion.evaluate(t, order)[:3] for order in range(3)])  # noqa: E731
    times, forces = midpoint(values_of(scene.bearing, scene.top, base(0.0)[0, :2]), base, end, step)
    return times, forces, np.stack([np.interp(times, history.time, f) for f in history.top_force.T], axis=-1)


if __name__ == "__main__":
    print(*compare(load_scene("fenz-test2"), end=7.0, step=2e-3), sep="\n")
