"""Landings by `seat_damping` and tolerance, and the models with and without uplift: prints docs/uplift.md's tables.

A rigid mass of 11.4 t on `prototype-tfp` is shaken vertically at 2 Hz, a little beyond 1 g, and sideways by 30 mm. The
run at 1.05 g is repeated with last digits changed. Then `fenz-test5`, tops on vertical springs and the hospital are run
with and without uplift where nothing lifts, and the contact points of all preset scenes are compared with the faces of
their sliders: `python benchmarks/uplift.py`; with `agreement` the runs with and without uplift alone.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
from plain import plain_hospital
from quick import parser, pick
from scipy.optimize import brentq

from msfp_gen import Effects, Motion, RunError, Scene, Solver, Top, load_scene, presets, simulate
from msfp_gen.results.geometry import contact_offsets

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


def spread(runs: int = 20) -> None:
    """Print how far runs of one scene lie apart whose motion differs in the last digit: what rounding decides."""
    print(
        "\n| rtol | at 0.7 s: least to largest [mm] | largest: least, mean, largest [mm] | spread |\n|---|---|---|---|"
    )
    for rtol in TOLERANCES:
        scene = bouncing(1.05, 10.0, rtol)
        before, peaks = [], []
        for k in range(runs):
            motion = replace(scene.motion, coefficients=(1 + k * np.finfo(float).eps) * scene.motion.coefficients)
            history = simulate(replace(scene, motion=motion)).history
            path = 1e3 * history.displacement[:, 0]
            before.append(np.interp(0.7, history.time, path))
            peaks.append(np.abs(path).max())
        least, most = min(peaks), max(peaks)
        print(
            f"| {rtol:g} | {min(before):.4f} to {max(before):.4f} | {least:.2f}, {np.mean(peaks):.2f}, {most:.2f} "
            f"| {most / least - 1:.2%} |",
            flush=True,
        )


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


def heaving(amplitude: float, sway: float) -> Motion:
    """Two seconds of a base that heaves at 8 Hz and sways at 0.7 Hz by these amplitudes [m], after a smooth start."""
    time = np.linspace(0.0, 2.0, 1601)
    start = np.clip(time / 0.5, 0.0, 1.0)
    wave = start**3 * (10 - 15 * start + 6 * start**2)
    path = np.zeros((len(time), 3))
    path[:, 0] = sway * wave * np.sin(2 * np.pi * 0.7 * time)
    path[:, 2] = amplitude * wave * np.sin(2 * np.pi * 8.0 * time)
    return Motion.from_arrays(time, path)


def on_spring(stiffness: float, ratio: float, rig: bool) -> Scene:
    """A rig that holds its height above a heaving base, or a mass on a vertical spring, with that damping ratio."""
    load, restraint = 112e3, (1e7, 1e4, stiffness, 2 * ratio * np.sqrt(stiffness * 11428.0))
    held = heaving(0.3 * load / stiffness, np.sqrt(0.2 * load / stiffness)), Top.rig(load, 1e8, 1e4, *restraint)
    carried = heaving(1.5 / (16 * np.pi) ** 2, SIDEWAYS), Top.mass(11428.0, 300.0, 0.5, *restraint)
    motion, top = held if rig else carried
    bearing = presets.bearing("fenz-tfp").replace(contact_damping=1e-4)
    return Scene(bearing, motion, top, Effects(), Solver(rtol=1e-5), output_step=1e-3)


def neutral() -> None:
    """Print what uplift changes where nothing lifts: N over that at rest, horizontal force over friction at rest."""
    print(
        "\n| scene | N over that at rest | N, largest | N, RMS | force, largest | force, RMS |\n|---|---|---|---|---|---|"
    )
    cases = [(True, 1e8, 0.05), (True, 1e9, 0.05), (True, 5e9, 0.05), (False, 6.5e7, 0.05), (False, 5e8, 0.05)]
    for rig, stiffness, ratio in [*cases, (False, 2e9, 0.2)]:
        scene = on_spring(stiffness, ratio, rig)
        runs = [simulate(replace(scene, effects=Effects(uplift=uplift))).history for uplift in (False, True)]
        rest = runs[0].normal_force[0].mean()
        friction = rest * max(surface.friction for surface in scene.bearing.surfaces)
        parts = [(r.normal_force / rest, r.top_force[:, :2] / friction) for r in runs]
        print(row(f"{'rig' if rig else 'mass'} on {stiffness:.2g} N/m, {ratio:.0%}", *parts), flush=True)
    for name in ("hospital-clc", "hospital-ccc"):
        scene = replace(plain_hospital(name), duration=25.0)
        parts = []
        for uplift in (False, True):
            bearings = [replace(each, effects=Effects(uplift=uplift)) for each in scene.bearings]
            result = simulate(replace(scene, bearings=bearings))
            friction = scene.axial_loads * [max(s.friction for s in each.bearing.surfaces) for each in bearings]
            forces = np.stack([each.history.top_force[:, :2] for each in result.bearings], axis=1) / friction[:, None]
            parts.append((result.axial_force / scene.axial_loads, forces))
        print(row(f"{name}, 25 s", *parts), flush=True)


def row(name: str, closed: tuple[np.ndarray, np.ndarray], lifting: tuple[np.ndarray, np.ndarray]) -> str:
    """A row of that table, from N and forces of both runs."""
    cells = []
    for before, after in zip(closed, lifting, strict=True):
        difference = np.abs(after - before)
        cells += [f"{difference.max():.2%}", f"{np.sqrt(np.mean(difference**2)):.3%}"]
    return f"| {name} | {closed[0].min():.2f} to {closed[0].max():.2f} | " + " | ".join(cells) + " |"


def contacts() -> None:
    """Print the largest distance of a contact point from the axis of its slider, over the radius of the face."""
    print("\n| scene | largest offset over radius, surface by surface |\n|---|---|")
    for name in islice(presets.names("scene"), pick(None, 2)):
        scene = load_scene(name)
        faces = scene.bearing.arrays()["rim_radius"][
            [scene.bearing.slider(j) for j in range(scene.bearing.layout.surfaces)]
        ]
        history = simulate(scene).history
        shares = (contact_offsets(scene.bearing, history.contact_angles, history.tilt_angles) / faces).max(axis=0)
        print(f"| {name} | " + ", ".join(f"{share:.2f}" for share in shares) + " |", flush=True)


def main() -> None:
    """Print the tables."""
    options = parser(__doc__)
    options.add_argument("part", nargs="?", choices=["agreement"], help="the runs with and without uplift alone")
    if options.parse_args().part:
        agreement()
        neutral()
        return
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
    spread()
    agreement()
    neutral()
    contacts()


if __name__ == "__main__":
    main()
