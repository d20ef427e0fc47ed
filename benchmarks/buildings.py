"""Cost of the run of a building: prints the tables of docs/buildings.md, and one of docs/performance.md.

`python benchmarks/buildings.py` measures cost over the number of bearings, and a hundred bearings under a record of 60 s;
`python benchmarks/buildings.py opensees` time and error beside OpenSees with its own triple pendulum (needs
openseespy); `python benchmarks/buildings.py ringing` what damping of the interfaces does to the dependence of rotations
on the tolerance; `python benchmarks/buildings.py slab` a flexible slab beside a rigid one; `python
benchmarks/buildings.py loaded` one thread, two threads and the chosen threads beside processes that the script starts.
The record is that of the preset ridgecrest-clc. Seconds are those of the processors; with two threads also those of the
clock.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from os import getloadavg
from pathlib import Path
from typing import Any

import numpy as np
from quick import QUICK, installed, parser, pick

from msfp_gen import (
    BaseSlab,
    Bearing,
    Body,
    Building,
    BuildingBearing,
    BuildingScene,
    Effects,
    Layout,
    Motion,
    Solver,
    Storey,
    Surface,
    Top,
    load_scene,
    presets,
)
from msfp_gen.buildings.fidelity import rigid_building
from msfp_gen.buildings.result import BuildingResult
from msfp_gen.buildings.run import building_result, start_building_run
from msfp_gen.common.arrays import Array
from msfp_gen.studies.accuracy.series import Series

CLIENT = Path(__file__).parents[1] / "tests" / "support" / "opensees_buildings.py"
SPACING = 6.0  # of the bearings [m]
DAMPING_TIME = 1e-3  # of the storeys, damping over stiffness [s]


def record(duration: float, axes: tuple[int, ...] = (1, 1, 1), begin: float = 0.0) -> tuple[Array, Motion]:
    """Accelerations of the record from a time on, at 0.01 s, shape (k, 3) [m/s^2], and its motion."""
    times = np.arange(round(duration / 0.01) + 1) * 0.01
    found = load_scene("ridgecrest-clc").motion.acceleration(begin + times) * axes
    found = (found - found[0]) * np.minimum(1.0, times / 0.2)[:, None]
    return found, Motion.from_acceleration(times, found)


def floors(mass: float, frequency: float, width: float, storeys: int = 3) -> list[BaseSlab | Storey]:
    """A base and storeys of that whole mass; each storey would swing at the frequency on its own columns [Hz]."""
    plan, share = mass * width**2 / 6, 0.6 / storeys
    stiffness = share * mass * (2 * np.pi * frequency) ** 2
    storey = Storey(
        height=3.5,
        mass=share * mass,
        inertia=(share / 2 * plan, share / 2 * plan, share * plan),
        stiffness=stiffness,
        torsional_stiffness=stiffness * width**2 / 6,
        mass_centre=(0.05 * width, 0.0),
        vertical_stiffness=share * mass * (2 * np.pi * 15.0) ** 2,
        rocking_stiffness=share * mass * (2 * np.pi * 15.0) ** 2 * width**2 / 6,
    )
    return [BaseSlab(0.4 * mass, (0.2 * plan, 0.2 * plan, 0.4 * plan)), *storeys * [storey]]


def frame(parts: list[BaseSlab | Storey]) -> Building:
    """The frame, with damping in proportion to stiffness."""
    made = Building.shear(parts[0], parts[1:], 0.0)  # type: ignore[arg-type]
    return Building(made.mass, DAMPING_TIME * made.stiffness, made.stiffness, made.nodes, made.columns)


def grid(count: int) -> list[tuple[float, float]]:
    """Places of the bearings in a square."""
    side = round(count**0.5)
    middle = 0.5 * SPACING * (side - 1)
    return [(SPACING * i - middle, SPACING * j - middle) for i in range(side) for j in range(side)]


def tower(count: int, duration: float, solver: Solver | None = None, storeys: int = 3) -> BuildingScene:
    """A frame on so many triple pendulums (preset prototype-tfp), each below 112 kN, under all components."""
    bearing = presets.bearing("prototype-tfp").replace(contact_damping=1e-4)
    parts = floors(count * 112e3 / bearing.gravity, 2.0, SPACING * count**0.5, storeys)
    interface = Top.node(1e7, 2e8, 1e6, 1e4, 4e5, 1e3)
    bearings = [BuildingBearing(bearing, interface, place) for place in grid(count)]
    return BuildingScene(frame(parts), bearings, record(duration)[1], solver or Solver())


def timed(scene: BuildingScene, threads: int | None = 1) -> tuple[BuildingResult, float, float]:
    """The result, and seconds of the processors and of the clock, without the building of the model. threads: None: chosen."""
    run = start_building_run(scene, threads)
    begin, clock = time.process_time(), time.perf_counter()
    while run.run.advance(1000):
        pass
    seconds = time.process_time() - begin, time.perf_counter() - clock
    assert run.run.status[0] == "ok", run.run.status
    return building_result(run), *seconds


def scaling() -> None:
    print("| bearings | steps | seconds | microseconds a step and bearing |\n|---|---|---|---|")
    for count in pick((4, 16, 36, 64, 100), (4,)):
        result, seconds, _ = timed(tower(count, pick(15.0, 1.0)))
        steps = result.counters["steps"]
        print(f"| {count} | {steps} | {seconds:.2f} | {1e6 * seconds / steps / count:.1f} |")
    largest_count, duration = pick(100, 4), pick(60.0, 1.0)
    for storeys, threads in ((3, 1), (3, 2), (5, 1), (5, 2)):
        result, seconds, clock = timed(tower(largest_count, duration, storeys=storeys), threads)
        largest = np.abs(result.bearing_displacement[:, :, :2]).max()
        print(
            f"{largest_count} bearings, {storeys} storeys, {duration:g} s, threads {threads}: {result.counters['steps']} steps, {seconds:.1f} s of the processors, "
            f"{clock:.1f} s of the clock; bearings {1e3 * largest:.0f} mm"
        )


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """So many processes that compute all the time, in the block."""
    started = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for each in started:
            each.kill()
            each.wait()


def loaded() -> None:
    """Print the time of a building on one thread, on two and on the chosen ones, in turn, beside busy processes."""
    scene, rounds = tower(pick(16, 4), pick(20.0, 0.5)), pick(3, 1)
    print("| busy processes | load average | one thread [s] | two threads [s] | as chosen [s] | chosen over one |")
    print("|---|---|---|---|---|---|")
    for processes in (0, 1, 2, 4):
        with busy(processes):
            taken = [[timed(scene, threads)[2] for threads in (1, 2, None)] for _ in range(rounds)]
            load = getloadavg()[0]
        one, two, chosen = np.median(taken, axis=0)
        print(f"| {processes} | {load:.1f} | {one:.2f} | {two:.2f} | {chosen:.2f} | {chosen / one:.2f} |", flush=True)


# Dao's example: shallow geometry times four and friction over three, so that tilts are small as the element assumes.
RADII, FRICTIONS, CAPACITIES, YIELD = (1.44, 5.0, 5.0), (0.004, 0.0173, 0.0467), (0.1, 0.2, 0.2), 2.5e-4
WEIGHT = 1e6  # on a bearing [N]
VERTICAL = 1e9  # stiffness of a bearing [N/m]


def shallow() -> tuple[Bearing, dict[str, Any]]:
    """The same bearing for this package and for OpenSees (tests/physics/test_opensees_client.py)."""
    inner, lower, upper = zip(RADII, CAPACITIES, FRICTIONS, strict=True)
    surfaces = [
        Surface(r, c, mu, YIELD * share, rim_stiffness=1e9, contact_damping=1e-4)
        for (r, c, mu), share in ((lower, 1.0), (inner, 0.5), (inner, 0.5), (upper, 1.0))
    ]
    light = [Body(height=2e-3, centroid=1e-3, mass=10.0, inertia=(1e-3, 1e-3), rim_radius=0.05) for _ in range(4)]
    bearing = Bearing(Layout.tfp(), 2e-3, surfaces, light, gravity=9.81)
    links = {link.surface: link for link in Series(bearing, rims=True).links}
    radii = [links[k].effective for k in (1, 0, 3)]
    begins = FRICTIONS[0] * RADII[0]
    outer = [(mu * r - begins) / (r - RADII[0]) for mu, r in zip(FRICTIONS[1:], RADII[1:], strict=True)]
    native = {"lengths": radii, "frictions": [FRICTIONS[0], *outer], "capacities": CAPACITIES}
    return bearing, {**native, "weight": WEIGHT, "yield_displacement": YIELD, "vertical_stiffness": VERTICAL}


def client(**arguments: Any) -> dict[str, Any]:
    """The answer of OpenSees."""
    done = subprocess.run([sys.executable, str(CLIENT)], input=json.dumps(arguments), capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def floors_given(
    parts: list[BaseSlab | Storey], damping_time: float | list[float] = DAMPING_TIME
) -> list[dict[str, Any]]:
    """The floors as the client takes them; damping_time: damping over stiffness of all springs, or of each [s]."""
    found, level = [], 0.0
    for part in parts:
        each: dict[str, Any] = {"mass": part.mass, "inertia": part.inertia, "mass_centre": part.mass_centre}
        if isinstance(part, Storey):
            level += part.height
            springs = {"springs": list(part.springs), "stiffness_centre": part.stiffness_centre}
            each |= {**springs, "damping_time": damping_time}
        found.append({**each, "level": level})
    return found


def beside_opensees(count: int, duration: float) -> None:
    """Time and error of both, each against its own fine run: relative to the largest value."""
    bearing, native = shallow()
    parts = floors(count * WEIGHT / 9.81, 2.0, SPACING * count**0.5)
    accelerations, motion = record(duration, (1, 1, 0))
    # A plate that tilts by N u/k under the moment of its load loses the share N R/k of the stiffness N/R.
    interface = Top.node(1e9, VERTICAL, 1e10, 1e6, 2e6, 1e7)
    effects = Effects(bouc_wen="plastic")
    bearings = [BuildingBearing(bearing, interface, place, effects=effects) for place in grid(count)]
    scene = BuildingScene(frame(parts), bearings, motion)
    found = {"msfp-gen": own(scene, parts[-1].mass_centre), "OpenSees": theirs(scene, native, parts, accelerations)}
    print(f"{count} bearings, {duration:g} s\n| program | setting | seconds | bearings | roof |\n|---|---|---|---|---|")
    for program, runs in found.items():
        _, _, paths, roofs = runs[-1]
        for setting, seconds, path, roof in runs:
            errors = [np.abs(a - b).max() / np.abs(b).max() for a, b in ((path, paths), (roof, roofs))]
            print(f"| {program} | {setting} | {seconds:.2f} | {100 * errors[0]:.3g} % | {100 * errors[1]:.3g} % |")
    largest = [float(np.abs(runs[-1][2]).max()) for runs in found.values()]
    print(f"largest displacement of a bearing: {largest[0]:.4f} m, OpenSees {largest[1]:.4f} m")


def own(scene: BuildingScene, centre: tuple[float, float]) -> list[tuple[str, float, Array, Array]]:
    """Runs of this package to ever smaller tolerances: setting, seconds, paths of the bearings, roof accelerations."""
    found = []
    for rtol in pick((1e-2, 1e-3, 1e-4, 1e-5, 1e-6), (1e-2, 1e-3)):
        result, seconds, _ = timed(replace(scene, solver=Solver(rtol=rtol)))
        roof = result.acceleration[1:] @ scene.building.node("floor 3").linked([*centre, 10.5])[:2].T
        found.append((f"rtol {rtol:g}", seconds, result.bearing_displacement[1:, :, :2], roof))
    return found


def theirs(
    scene: BuildingScene, native: dict[str, Any], parts: list[BaseSlab | Storey], ground: Array
) -> list[tuple[str, float, Array, Array]]:
    """The same of OpenSees, with ever shorter steps."""
    found = []
    for step in pick((0.01, 0.005, 0.0025, 0.00125, 0.000625), (0.01, 0.005)):
        loads = zip(scene.bearings, scene.axial_loads.tolist(), strict=True)
        bearings = [{**native, "position": each.position, "load": load, "weight": load} for each, load in loads]
        answer = client(
            floors_given=floors_given(parts),
            bearings_given=bearings,
            ground=ground.T.tolist(),
            ground_step=0.01,
            step=step,
            count=round(scene.end / step),
            every=round(0.01 / step),
            tolerance=1e-6 * WEIGHT,
        )
        if answer["status"]:
            print(f"OpenSees, step {step:g} s: it ends after {len(answer['acceleration'])} rows")
            continue
        roof = np.array(answer["acceleration"])[:, :2] + ground[1:, :2]
        found.append((f"step {step:g} s", answer["seconds"], np.array(answer["displacement"])[:, :, :2], roof))
    return found


def ringing() -> None:
    """Print how far rotations and accelerations of a slab differ between tolerances, by the damping of its springs."""
    bearing = presets.bearing("prototype-tfp").replace(contact_damping=1e-4)
    mass, vertical = 4 * 112e3 / bearing.gravity, 5e7
    slab = Building.shear(BaseSlab(mass, (3 * mass, 3 * mass, 6 * mass), (0.4, 0.2)), [])
    acceleration, _ = record(15.0)
    motion = Motion.from_acceleration(np.arange(len(acceleration)) * 0.01, 0.3 * acceleration)
    tolerances, reference = (1e-3, 1e-4), 1e-5
    print("| damping ratio | rtol | rotation | rotational acceleration | acceleration | N |\n|---|---|---|---|---|---|")
    for ratio in (0.0, 0.005, 0.01, 0.02, 0.05):
        damping = 2 * ratio * np.sqrt(vertical * 0.25 * mass)
        interface = Top.node(1e8, vertical, 1e7, 1e5, damping, 1e4)
        places = ((3.0, 2.0), (-3.0, 2.0), (-3.0, -2.0), (3.0, -2.0))
        bearings = [BuildingBearing(bearing, interface, place, effects=Effects()) for place in places]
        scene = BuildingScene(slab, bearings, motion)
        found = []
        for rtol in (*tolerances, reference):
            result, *_ = timed(replace(scene, solver=Solver(rtol=rtol)))
            turning = [np.abs(result.node("base")[:, order, 3:5]).max(axis=0) for order in (0, 2)]
            found.append((*turning, result.extremes.node_acceleration, result.extremes.axial_force))
        for rtol, peaks in zip(tolerances, found[:-1], strict=True):
            cells = [f"{np.abs(a - b).max() / np.abs(b).max():.1%}" for a, b in zip(peaks, found[-1], strict=True)]
            print(f"| {ratio:.1%} | {rtol:g} | " + " | ".join(cells) + " |", flush=True)


BAYS, BAY, LEVEL = (10, 7), 6.0, 3.5  # columns in both directions, their distance and height [m]


def beam(length: float, width: float, depth: float, axis: int) -> Array:
    """Stiffness of a beam of concrete along an axis, from displacements and rotations of both ends, shape (12, 12)."""
    elastic, shear, area = 30e9, 12e9, width * depth
    found = np.zeros((12, 12))
    axial, torsion = elastic * area / length, shear * 0.2 * area * min(width, depth) ** 2 / length
    for index, value in ((0, axial), (3, torsion)):
        found[np.ix_([index, index + 6], [index, index + 6])] = value * np.array([[1, -1], [-1, 1]])
    for shift, turn, sign, inertia in (
        (1, 5, 1, width * depth**3 / 12),
        (2, 4, -1, depth * width**3 / 12),
    ):
        a, b = 6 * length * sign, length**2
        bending = np.array([[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]])
        places = np.ix_([shift, turn, shift + 6, turn + 6], [shift, turn, shift + 6, turn + 6])
        found[places] += elastic * inertia / length**3 * bending
    turned = np.kron(np.eye(4), np.roll(np.eye(3), axis, axis=1))
    return turned.T @ found @ turned


def beams() -> Building:
    """A frame of beams of 1,890 coordinates: a slab on bearings at 70 columns, three floors, a roof of half the plan."""
    levels = [(i, j, k) for k in range(5) for i in range(BAYS[0] if k < 4 else 5) for j in range(BAYS[1])]
    nodes = {place: np.arange(6) + 6 * index for index, place in enumerate(levels)}
    stiffness, mass = np.zeros((6 * len(nodes), 6 * len(nodes))), np.zeros(6 * len(nodes))
    for place, own in nodes.items():
        mass[own] += 600 * BAY**2 * np.array([1, 1, 1, *3 * [BAY**2 / 12]])
        for axis, (length, width, depth) in enumerate(((BAY, 0.5, 0.8), (BAY, 0.5, 0.8), (LEVEL, 0.6, 0.6))):
            other = nodes.get(tuple(np.add(place, np.eye(3, dtype=int)[axis]).tolist()))
            if other is None:
                continue
            both = np.concatenate([own, other])
            stiffness[np.ix_(both, both)] += beam(
                length, width, depth * (1.5 if place[2] == 0 and axis < 2 else 1), axis
            )
            half = 2500 * width * depth * length / 2
            mass[both] += half * np.tile([1, 1, 1, *3 * [length**2 / 24]], 2)
    middle = (np.array(BAYS) - 1) / 2
    held = {
        f"column {i} {j}": (own.tolist(), [BAY * (i - middle[0]), BAY * (j - middle[1]), 0.0])
        for (i, j, k), own in nodes.items()
        if k == 0
    }
    return Building.from_matrices(np.diag(mass), None, stiffness, nodes=held, damping_ratio=0.03)


def slab() -> None:
    """Print the cost of a step of that frame reduced to 15 Hz, over a step of the same mass on a rigid slab."""
    flexible = beams().reduced(15.0)
    bearing = presets.bearing("building-tfp").replace(contact_damping=1e-4)
    interface = Top.node(1e9, 2e9, 5e7, 1e6, 6e6, 1e5)
    motion, found = record(pick(1.0, 0.1), begin=9.0)[1], []
    print(
        "| slab | coordinates | steps | lengths of steps | seconds | milliseconds a step |\n|---|---|---|---|---|---|"
    )
    for name, building in (("rigid", rigid_building(flexible)), ("flexible", flexible)):
        bearings = [
            BuildingBearing(bearing, interface, node=node.name, effects=Effects())
            if building is flexible
            else BuildingBearing(bearing, interface, tuple(node.position[:2]), building.nodes[0].name, Effects())
            for node in flexible.nodes
        ]
        result, seconds, _ = timed(BuildingScene(building, bearings, motion, Solver(max_step=0.004)))
        steps = result.counters["steps"] + result.counters["rejected_steps"]
        found.append(seconds / steps)
        print(
            f"| {name} | {len(building.mass)} | {steps} | {result.counters['step_lengths']} | {seconds:.2f} | "
            f"{1e3 * found[-1]:.2f} |"
        )
    print(f"a step of the flexible slab costs {found[1] / found[0]:.1f} times a step of the rigid one")


if __name__ == "__main__":
    options = parser(__doc__)
    tables = {"scaling": scaling, "ringing": ringing, "slab": slab, "loaded": loaded}
    options.add_argument("table", nargs="?", choices=[*tables, "opensees"], help="only this one; default: scaling")
    chosen = options.parse_args().table
    if chosen != "opensees":
        tables[chosen or "scaling"]()
    compared = chosen == "opensees" or (QUICK and chosen is None)
    if compared and installed("openseespy.opensees", "four bearings beside OpenSees"):
        beside_opensees(4, pick(12.0, 1.0))
