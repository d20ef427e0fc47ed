"""Landings by `seat_damping` and tolerance, and agreement of the models at the rims: prints docs/uplift.md's tables.

A rigid mass of 11.4 t on `prototype-tfp` is shaken vertically at 2 Hz, a little beyond 1 g, and sideways by 30 mm. Then
`fenz-test5` is run with and without uplift, and the contact points of all preset scenes are compared with the faces of
their sliders: `python benchmarks/uplift.py`.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
from quick import parser, pick
from scipy.optimize import brentq

from msfp_gen import Effects, Motion, RunError, Scene, Solver, Top, load_scene, presets, simulate
from msfp_gen.results.geometry.shape import contact_offsets

GRAVITY = 9.8
SHAKE = 2 * np.pi * 2.0  # [rad/s]
SIDEWAYS = 0.03  # [m]
DAMPINGS = pick((1.0, 3.0, 10.0, 30.0), (10.0,))  # c of the unilateral contact [s/m]
PEAKS = pick((1.02, 1.05, 1.1, 1.2), (1.05,))  # vertical acceleration [g]
TOLERANCES = pick((1e-3, 1e-4, 3e-5, 1e-5), (1e-3,))
VELOCITIES = (0.03, 0.08, 0.1, 0.3)  # of a landing [m/s]


def restitution(damping: float, velocity: float) -> float:
    """Velocity after an impact over that before it, for P = k d (1 + c dd/dt).

    From the energy balance v dv = -(k/m) d (1 + c v) dd: v/c - ln(1 + c v)/c^2 is the same at both ends of the contact.
    """
    before = damping * velocity
    store = before - np.log1p(before)
    after = brentq(lambda x: -x - np.log1p(-x) - store, 0.0, 1.0 - 1e-12)
    return float(after / before)


def bouncing(peak: float, damping: float, rtol: float) -> Scene:
    """The scene with a vertical acceleration of `peak` g after a smooth start of 0.5 s."""
    time = np.linspace(0.0, 1.6, 641)
    start = np.clip(time / 0.5, 0.0, 1.0)
    wave = start**3 * (10 - 15 * start + 6 * start**2)
    path = np.zeros((len(time), 3))
    path[:, 2] = peak * GRAVITY / SHAKE**2 * wave * np.sin(SHAKE * time)
    path[:, 0] = SIDEWAYS * wave * np.sin(0.5 * SHAKE * time)
    bearing = presets.bearing("prototype-tfp").replace(seat_damping=damping)
    top = Top.mass(mass=11428.0, inertia=300.0, height=0.5, rotational_stiffness=1e7, rotational_damping=1e4)
    effects = Effects(dimension="planar", uplift=True)
    return Scene(bearing, Motion.from_arrays(time, path), top, effects=effects, solver=Solver(rtol=rtol))


def cell(peak: float, damping: float, rtol: float) -> tuple[float, str]:
    """Largest opening [mm], and the largest displacement across the bearing [mm] as a cell of the table."""
    try:
        result, end = simulate(bouncing(peak, damping, rtol)), ""
    except RunError as error:
        result, end = error.result, f", `{error.status}`"
    displacement = 1e3 * np.abs(result.history.displacement[:, 0]).max()
    return float(1e3 * result.history.lift.max()), f"{displacement:.2f}{end}"


def agreement() -> None:
    """Print the differences of the top force of `fenz-test5` with uplift, over the peak force."""
    scene = load_scene("fenz-test5")
    time = np.linspace(0.0, scene.end, 20001)
    forces = []
    for uplift in (False, True):
        effects = replace(scene.modelled, uplift=uplift)
        history = simulate(replace(scene, effects=effects, solver=replace(scene.solver, rtol=1e-5))).history
        forces.append(np.interp(time, history.time, history.top_force[:, 0]))
    difference, peak = np.abs(forces[1] - forces[0]), np.abs(forces[0]).max()
    rms = np.sqrt(np.mean(difference**2))
    print(f"\nfenz-test5 with uplift: largest {difference.max() / peak:.2%}, RMS {rms / peak:.3%} of the peak force")


def contacts() -> None:
    """Print the largest distance of a contact point from the axis of its slider, over the radius of the face."""
    print("\n| scene | largest offset over radius, surface by surface |\n|---|---|")
    for name in islice(presets.names("scene"), pick(None, 2)):
        scene = load_scene(name)
        faces = scene.bearing.arrays()["rim_radius"][
            [scene.bearing.slider(j) for j in range(scene.bearing.layout.surfaces)]
        ]
        shares = (contact_offsets(scene.bearing, simulate(scene).history) / faces).max(axis=0)
        print(f"| {name} | " + ", ".join(f"{share:.2f}" for share in shares) + " |", flush=True)


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    print("| c [s/m] | " + " | ".join(f"{1e3 * v:.0f} mm/s" for v in VELOCITIES) + " |")
    print("|---" * (1 + len(VELOCITIES)) + "|")
    for damping in DAMPINGS:
        print(f"| {damping:g} | " + " | ".join(f"{restitution(damping, v):.2f}" for v in VELOCITIES) + " |")
    print("\n| vertical [g] | opening [mm] | c [s/m] | " + " | ".join(f"rtol {rtol:g}" for rtol in TOLERANCES) + " |")
    print("|---" * (3 + len(TOLERANCES)) + "|")
    for peak in PEAKS:
        for damping in DAMPINGS:
            lifts, cells = zip(*(cell(peak, damping, rtol) for rtol in TOLERANCES), strict=True)
            print(f"| {peak:g} | {lifts[-1]:.2g} | {damping:g} | " + " | ".join(cells) + " |", flush=True)
    agreement()
    contacts()


if __name__ == "__main__":
    main()
