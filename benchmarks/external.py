"""Comparisons with tables and formulas of others, point by point: part of `validation.py`.

Tables of other programs are in `data/`, each with its source in the first lines.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import devices
import numpy as np
from drawing import Array
from scipy.optimize import brentq

from msfp_gen import Bearing, Body, Effects, Layout, Load, Motion, Scene, Solver, Surface, Top, simulate
from msfp_gen.auditing import read_histories
from msfp_gen.auditing.stated import stated_of
from msfp_gen.scene.fidelity import series_links
from msfp_gen.scene.scene_fields import InitialState
from msfp_gen.studies.accuracy.series import YIELD as LEAST_YIELD
from msfp_gen.studies.accuracy.series import run_opensees
from msfp_gen.studies.accuracy.timed_run import comparison_times

DATA = Path(__file__).with_name("data")
MAT = DATA.parents[1] / "examples" / "basemat"
SLIDER = 0.2  # radius [m] of the bearing of MASTODON
RADIUS, MU, WEIGHT = 2.2352, 0.06, 6285710.0
STIFFNESS = 50e6 * np.pi * SLIDER**2 * MU / 1e-3  # of its shear before sliding [N/m]


class Point(NamedTuple):
    """One comparison: where or when, with its unit; the reference; and ours."""

    at: str
    reference: float
    ours: float


class Series(NamedTuple):
    """Comparisons of one quantity with one source.

    Attributes:
        name, source, kind, quantity: as in a row of the page; kind is a key of `TOLERANCE`.
        points: the comparisons.
    """

    name: str
    source: str
    kind: str
    quantity: str
    points: list[Point]

    @property
    def scale(self) -> float:
        """The largest reference."""
        return max(abs(point.reference) for point in self.points)

    @property
    def differences(self) -> Array:
        """Ours less the reference, over the scale, shape (points,)."""
        return np.array([point.ours - point.reference for point in self.points]) / self.scale

    @property
    def within(self) -> int:
        """Number of points within the tolerance of the kind."""
        return int((np.abs(self.differences) <= TOLERANCE[self.kind]).sum())


# Largest difference that is expected over the largest reference, by what a reference is worth: never by case.
TOLERANCE = {"closed form": 0.01, "program": 0.05, "formula": 0.1, "model": 0.15, "experiment": 0.15}


def read(name: str) -> dict[str, Array]:
    """The columns of a table in `data/`."""
    lines = [line for line in (DATA / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    return {column: np.array([float(row[column]) for row in rows]) for column in rows[0]}


def mastodon_bearing(velocity: bool, pressure: bool, temperature: bool) -> Bearing:
    """The isolator of MASTODON's tests: a point on the dish. Factors that a test leaves out are one.

    Its stiffness before sliding does not depend on friction; ours is mu N over the yield displacement, with mu at rest.
    """
    slow = MU * (0.5 if velocity else 1.0)
    law = {
        "pressure_ratio": 0.7 if pressure else 1.0,
        "velocity_drop": 0.5 if velocity else 0.0,
        "temperature_ratio": 0.7 if temperature else 1.0,
        "velocity_rate": 100.0,
        "reference_pressure": 50e6,
        "patch_radius": SLIDER,
        "conductivity": 18.0,
        "diffusivity": 4.4e-6,
    }
    surface = Surface(
        radius=RADIUS,
        capacity=1.0,
        friction=MU,
        yield_displacement=slow * WEIGHT / (STIFFNESS - WEIGHT / RADIUS),
        contact_damping=0.0,
        **law,
    )
    body = Body(height=1e-6, centroid=5e-7, mass=1.0, inertia=1e-3)
    return Bearing(layout=Layout(2, 1, 0), base_height=1e-3, surfaces=[surface], bodies=[body], gravity=9.81)


def mastodon_shear() -> Iterator[Series]:
    """Reaction of the pushed isolator, friction by pressure, velocity, temperature and all three."""
    given = read("mastodon-shear.csv")
    time, push = given["time"] - given["time"][0], given["displacement"]
    motion = Motion.from_arrays(time, np.column_stack([push, 0 * push, 0 * push]))
    effects = Effects(dimension="planar", sliders="massless", rims=False, bouc_wen="plastic", friction="pvt")
    for word in ("P", "V", "T", "PTV"):
        bearing = mastodon_bearing(*(letter in word for letter in "VPT"))
        scene = Scene(bearing, motion, Top.rig(WEIGHT, 1e12), effects, Solver(rtol=1e-5), output_step=0.005)
        ours = -simulate(scene).history.top_force[:, 0]
        rows = range(14, len(time), 6)
        points = [Point(f"{given['time'][i]:.3f} s", given[word][i], float(ours[i])) for i in rows]
        name = f"isolator under 6.29 MN pushed at 0.5 Hz, {word}"
        yield Series(name, "MASTODON, gold table", "program", "force [N]", points)


def mastodon_seismic() -> Iterator[Series]:
    """Reactions along three axes of the isolator below a mass on a base that accelerates."""
    given = read("mastodon-seismic.csv")
    time = given["time"] - given["time"][0]
    ground = np.column_stack([given[f"accel_{axis}"] for axis in "yzx"])
    motion = Motion.from_acceleration(time, ground)
    top = Top.mass(640745.0, 1e-3, 0.0)
    effects = Effects(rims=False, bouc_wen="plastic", friction="pvt")
    bearing = mastodon_bearing(True, True, True)
    history = simulate(Scene(bearing, motion, top, effects, Solver(rtol=1e-6), output_step=1e-3)).history
    for column, axis in enumerate("yzx"):
        reference, ours = given[f"reaction_{axis}"], history.top_force[:, column]
        points = [Point(f"{given['time'][i]:.3f} s", reference[i], float(ours[i])) for i in range(5, len(time))]
        name = f"isolator below 641 t, three axes, {axis}"
        yield Series(name, "MASTODON, gold table", "program", "force [N]", points)


def mat_on_pendulums(inertia: float) -> tuple[Array, Array, Array]:
    """Time [s], and displacement [m] of one bearing of a published plant by MASTODON and by a run, (T,) each.

    inertia: how many times the mass of the mat acts; its weight acts once.
    """
    data, bearing = read_histories(MAT / "case1.csv", MAT / "map.toml"), stated_of(MAT / "bearing.toml").bearing
    assert data.mass is not None
    ground, mass = data.columns["base_acceleration_1"], data.mass / data.bearings
    motion = Motion.from_acceleration(data.time, np.column_stack([ground, 0 * ground, 0 * ground]))
    effects = Effects(dimension="planar", rims=False, friction="constant", sliders="massless")
    load = Load.constant((0.0, 0.0, (inertia - 1.0) * mass * bearing.gravity))
    top = Top.mass(inertia * mass, 1e-3, 0.0)
    history = simulate(Scene(bearing, motion, top, effects, Solver(rtol=1e-5), output_step=0.01, load=load)).history
    ours = np.interp(data.time, history.time, history.displacement[:, 0])
    return data.time, data.columns["displacement_1"], ours


def point_on_a_dish(radius: float, friction: float, capacity: float, yielding: float = 1e-5) -> Bearing:
    """A slider without extent: its mass is on the sphere."""
    surface = Surface(
        radius=radius, capacity=capacity, friction=friction, yield_displacement=yielding, contact_damping=1e-4
    )
    body = Body(height=1e-6, centroid=5e-7, mass=1.0, inertia=1e-9)
    return Bearing(layout=Layout(2, 1, 0), base_height=1e-3, surfaces=[surface], bodies=[body], gravity=9.81)


PLANE = Effects(dimension="planar", rims=False, bouc_wen="plastic")


def sliding_block() -> Iterator[Series]:
    """Slip of a block on a flat base that gets a velocity by a rectangular pulse: V^2/2 (1/(mu g) - 1/A)."""
    points = []
    for friction in (0.05, 0.1, 0.2):
        for ratio in (1.5, 2.0, 3.0, 5.0, 8.0):
            limit, length = friction * 9.81, 0.2
            pulse, rest = ratio * limit, 1.1 * (ratio - 1) * length + 0.1
            pieces = np.zeros((2, 6, 6))
            pieces[0, 0, 2] = pulse / 2
            pieces[1, 0, :2] = pulse * length**2 / 2, pulse * length
            motion = Motion(np.array([0.0, length, length + rest]), pieces, np.array([length]))
            bearing = point_on_a_dish(1e6, friction, 10.0)
            scene = Scene(bearing, motion, Top.prescribed((0.0, 0.0, 0.0)), PLANE, Solver(rtol=1e-6))
            ours = float(np.abs(simulate(scene).history.sliding[-1, 0]))
            slip = (pulse * length) ** 2 / 2 * (1 / limit - 1 / pulse)
            points.append(Point(f"mu {friction:g}, A/(mu g) {ratio:g}", slip, ours))
    yield Series("block on a base that jerks", "Newmark 1965", "closed form", "slip [m]", points)


def turning_angles(radius: float, friction: float, start: float) -> list[float]:
    """Angles at which a block on a circle with Coulomb friction turns, from rest at `start` [rad].

    With w = theta'^2 and s the direction of motion, dw/dtheta = -2 g/R (sin + s mu cos) - 2 s mu w has the solution
    A cos + B sin + C exp(-2 s mu theta).
    """
    found, angle, sign = [], start, -1.0
    while abs(np.tan(angle)) > friction:
        m = sign * friction
        a, b = 2 * (1 - 2 * m * m) / (1 + 4 * m * m), -6 * m / (1 + 4 * m * m)

        def speed(x: float, m: float = m, a: float = a, b: float = b, angle: float = angle) -> float:
            smooth = a * np.cos(x) + b * np.sin(x)
            return float(smooth - (a * np.cos(angle) + b * np.sin(angle)) * np.exp(-2 * m * (x - angle)))

        angle = float(brentq(speed, angle + sign * 1e-3, -1.2 * angle + sign * 1e-3))
        found.append(angle)
        sign = -sign
    return found


def circle_with_friction() -> Iterator[Series]:
    """Turning angles of a block that is let go on a circle."""
    points = []
    for friction in (0.02, 0.05, 0.1):
        for start in (0.2, 0.4, 0.6):
            bearing = point_on_a_dish(2.0, friction, 2.5)
            still = Motion(np.array([0.0, 12.0]), np.zeros((1, 6, 6)))
            state = InitialState([[0.0, start, 0.0]], [[0.0, 0.0, 0.0]], [[0.0, 0.0]])
            top = Top.prescribed((0.0, 0.0, 0.0))
            scene = Scene(bearing, still, top, PLANE, Solver(rtol=1e-6), initial_state=state, output_step=1e-3)
            angle = simulate(scene).history.tilt_angles[:, 0, 1]
            expected = turning_angles(2.0, friction, start)[:3]
            turns = np.flatnonzero(np.diff(np.sign(np.diff(angle))) * np.sign(angle[1:-1]) < 0) + 1
            large = [float(angle[i]) for i in turns if abs(angle[i]) > 0.5 * abs(expected[-1])]
            for number, (reference, ours) in enumerate(zip(expected, large, strict=False), start=1):
                points.append(Point(f"mu {friction:g}, from {start:g} rad, turn {number}", reference, ours))
    source = "González-Cataldo, Gutiérrez and Yáñez 2017"
    yield Series("block let go on a circle", source, "closed form", "turning angle [rad]", points)


LOOP = 0.25 * np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.4, 0.0, -0.4, -0.8, -1.0, -0.6, -0.2, 0.2, 0.6])  # [m]
ORBIT = np.linspace(0.0, 2 * np.pi, 25)  # of the orbit [rad]
FLAT_LOAD = 1e6  # [N]


def single_element(radius: float, law: str, *numbers: float, options: Sequence[str] = ()) -> Any:
    """OpenSees with a `singleFPBearing` between nodes 1 and 2 under `FLAT_LOAD`.

    numbers: of its friction law; options: further ones of the element.
    """
    ops = import_module("openseespy.opensees")
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    ops.node(1, 0.0, 0.0, 0.0)
    ops.node(2, 0.0, 0.0, 0.0)
    ops.fix(1, 1, 1, 1, 1, 1, 1)
    ops.fix(2, 0, 0, 0, 1, 1, 1)
    ops.frictionModel(law, 1, *numbers)
    ops.uniaxialMaterial("Elastic", 1, 1e11)
    stiffness = numbers[0] * FLAT_LOAD / YIELD + FLAT_LOAD / radius
    axes = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
    materials = ("-P", 1, "-T", 1, "-My", 1, "-Mz", 1)
    ops.element(
        "singleFPBearing", 1, 1, 2, 1, radius, stiffness, *materials, "-orient", *axes, *options, "-iter", 100, 1e-4
    )
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(2, 0.0, 0.0, -FLAT_LOAD, 0.0, 0.0, 0.0)
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-4, 100, 0)
    ops.algorithm("Newton")
    return ops


def single_of_opensees(radius: float, friction: float, path: Array, steps: int) -> Array:
    """Forces on the upper node of OpenSees' `singleFPBearing` at the points of a path, (k, 2) [N].

    path: displacement of that node, shape (k, 2) [m]; steps: between two points.
    """
    ops = single_element(radius, "Coulomb", friction)
    values = np.column_stack([np.interp(np.arange(len(path) * steps) / steps, range(len(path)), x) for x in path.T])
    for axis in (0, 1):
        ops.timeSeries("Path", 10 + axis, "-dt", 1.0 / steps, "-values", *values[:, axis].tolist())
        ops.pattern("Plain", 10 + axis, 10 + axis)
        ops.sp(2, axis + 1, 1.0)
    ops.integrator("LoadControl", 1.0 / steps)
    ops.analysis("Static")
    forces = np.zeros((len(path), 2))
    for row in range(1, len(path)):
        assert ops.analyze(steps) == 0, f"OpenSees failed at point {row}"
        forces[row] = np.array(ops.eleForce(1))[6:8]
    ops.wipe()
    return forces


SHAKING = 6.0  # [s]
GROUND = np.arange(0.0, SHAKING + 5e-4, 1e-3)  # times of its samples [s]


def ground() -> Array:
    """Acceleration of the base along E1, E2 with a smooth start, shape (k, 2) [m/s^2]."""
    start = np.minimum(GROUND / 1.0, 1.0) ** 2 * (3 - 2 * np.minimum(GROUND / 1.0, 1.0))
    return start[:, None] * np.column_stack([2.5 * np.sin(2 * np.pi * 0.6 * GROUND), 1.5 * np.sin(2 * np.pi * GROUND)])


def shaken_mass_of_opensees(radius: float, law: str, *numbers: float, options: Sequence[str] = ()) -> Array:
    """Forces of the element on a mass on a shaken base, at `GROUND`, shape (k, 2) [N]."""
    ops = single_element(radius, law, *numbers, options=options)
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    mass, shaking = FLAT_LOAD / 9.81, ground()
    ops.mass(2, mass, mass, mass, 0.0, 0.0, 0.0)
    for axis in (0, 1):
        values = [*shaking[:, axis].tolist(), float(shaking[-1, axis])]
        ops.timeSeries("Path", 10 + axis, "-dt", 1e-3, "-values", *values)
        ops.pattern("UniformExcitation", 10 + axis, axis + 1, "-accel", 10 + axis)
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormUnbalance", 1e-2, 100, 0)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    forces = np.zeros((len(GROUND), 2))
    for row in range(1, len(GROUND)):
        assert ops.analyze(1, 1e-3) == 0, f"OpenSees failed at {GROUND[row]:.3f} s"
        forces[row] = -np.array(ops.eleForce(1))[6:8]
    ops.wipe()
    return forces


def lifting(version: str) -> str:
    """The option of `singleFPBearing` for vertical displacement as a version of OpenSees spells it.

    Each version reads one spelling only, and passes over the other in silence.
    """
    first = tuple(int(number) for number in version.split(".")[:2])
    return "-inclVertDisp" if first >= (3, 8) else "-inclVertdisp"


def acted(plain: Array, lifted: Array, version: str) -> Array:
    """The forces with an option, shape (k, 2) [N]. Raises AssertionError where it changes nothing."""
    change = float(np.abs(lifted - plain).max() / np.abs(plain).max())
    assert change > 1e-6, f"OpenSees {version} passes over {lifting(version)}: forces change by {change:.1e}"
    return lifted


def opensees_shaken() -> Iterator[Series]:
    """A mass on one bearing on a base shaken in two directions, with constant friction and by velocity."""
    source = "OpenSees singleFPBearing, transient"
    slow = {"friction_slow": 0.03, "velocity_rate": 20.0}
    for name, law, numbers, values, word in (
        ("constant friction", "Coulomb", (0.06,), {}, "constant"),
        ("friction by velocity", "VelDependent", (0.03, 0.06, 20.0), slow, "velocity"),
    ):
        for radius in (2.0, 4.0):
            bearing = point_on_a_dish(radius, 0.06, 0.9 * radius, YIELD)
            bearing = bearing.replace(**{key: [value] for key, value in values.items()})
            effects = Effects(rims=False, bouc_wen="plastic", friction=word)
            motion = Motion.from_acceleration(GROUND, np.column_stack([ground(), 0 * GROUND]))
            top = Top.mass(FLAT_LOAD / 9.81, 1e-3, 0.0)
            history = simulate(Scene(bearing, motion, top, effects, Solver(rtol=1e-5), output_step=0.05)).history
            label = f"mass on a shaken base, R {radius:g} m, {name}"
            version = str(import_module("openseespy.opensees").version())
            plain = shaken_mass_of_opensees(radius, law, *numbers)
            lifted = acted(plain, shaken_mass_of_opensees(radius, law, *numbers, options=(lifting(version),)), version)
            for suffix, reference in (("", plain), (", with vertical displacement", lifted)):
                for axis in range(2):
                    points = [
                        Point(f"{history.time[i]:.2f} s", reference[50 * i, axis], float(history.top_force[i, axis]))
                        for i in range(4, len(history.time), 4)
                    ]
                    yield Series(label, source + suffix, "program", f"force along E{axis + 1} [N]", points)


def opensees_single() -> Iterator[Series]:
    """Loops and orbits of a single pendulum against OpenSees' `singleFPBearing`."""
    loop = halved(np.column_stack([LOOP, 0 * LOOP]))
    orbit = halved(0.2 * np.column_stack([np.sin(ORBIT), np.sin(2 * ORBIT)]))
    limits = [(100.0, 0.1), (2.0, 1e-3)]  # next to no curvature, next to no friction
    cases = [*product((1.0, 2.0, 4.0), (0.03, 0.1)), *limits]
    for (radius, friction), (name, path, axes) in product(cases, (("loop", loop, (0,)), ("orbit", orbit, (0, 1)))):
        reference, ours = single_of_opensees(radius, friction, path, 100), slow_path(radius, friction, path)
        label = f"single pendulum, R {radius:g} m, mu {friction:g}, {name}"
        for axis in axes:
            points = [
                Point(f"({path[i, 0]:.3f}, {path[i, 1]:.3f}) m", reference[i, axis], float(ours[i, axis]))
                for i in range(1, len(path), 2)
            ]
            source = "OpenSees singleFPBearing"
            yield Series(label, source, "program", f"force along E{axis + 1} [N]", points)


def halved(path: Array) -> Array:
    """The path with the middle between every two points, where no corner is near, at odd indices."""
    whole = np.arange(2 * len(path) - 1) / 2
    return np.column_stack([np.interp(whole, range(len(path)), x) for x in path.T])


YIELD = 1e-3  # yield displacement of both [m]


def slow_path(radius: float, friction: float, path: Array) -> Array:
    """Forces of our pendulum at the points of the same path, half a second for each, shape (k, 2) [N]."""
    fine = np.linspace(0.0, len(path) - 1.0, 100 * (len(path) - 1) + 1)
    along = np.column_stack([*(np.interp(fine, range(len(path)), x) for x in path.T), 0 * fine])
    # Corners are rounded within a step of OpenSees to each side.
    kernel = np.array([0.25, 0.5, 0.25])
    along[1:-1] = np.column_stack([np.convolve(x, kernel, "valid") for x in along.T])
    bearing = point_on_a_dish(radius, friction, 0.9 * radius, YIELD)
    effects = Effects(rims=False, bouc_wen="plastic")
    motion = Motion.from_arrays(fine / 2, along)
    scene = Scene(bearing, motion, Top.rig(FLAT_LOAD, 1e12), effects, Solver(rtol=1e-5), output_step=0.5)
    return simulate(scene).history.top_force[:, :2]


def device_points() -> Iterator[Series]:
    """Single to quintuple pendulums pushed through all sliding regimes, at every displacement of docs/bearing.md."""
    for device in devices.DEVICES:
        rows = devices.rows(device)
        for column, source, kind in devices.references(device):
            points = [Point(f"{1e3 * row['u']:.0f} mm", row[column], row["run"]) for row in rows]
            yield Series(f"{device.title} pendulum", source, kind, "F/W", points)


def opensees_triple(scenes: Sequence[Scene], steps: int) -> Iterator[Series]:
    """Forces of OpenSees' `TripleFrictionPendulum` along whole runs; ours with friction at the pivot, as there.

    Then ours with the yield displacement of the element too: that of the bearing as a whole, where two surfaces slide.
    """
    source = "OpenSees TripleFrictionPendulum, ours with friction at the pivot"
    for scene in scenes:
        theirs = run_opensees(scene, steps)
        assert theirs.status == "ok", theirs.message
        forces = theirs.histories["force"][:, 0]
        at, pick = comparison_times(scene.end), slice(len(forces) // 24, None, len(forces) // 24)
        friction = [surface.friction for surface in scene.bearing.surfaces]
        pivot = scene.bearing.replace(friction=friction, friction_at="pivot")
        equal = pivot.replace(yield_displacement=shared_yield(scene.bearing))
        for suffix, bearing in (("", pivot), (" and the yield displacement of the element", equal)):
            history = simulate(replace(scene, bearing=bearing, output_step=float(at[1]))).history
            for axis in range(2):
                ours = history.top_force[: len(at), axis]
                if not np.any(forces[:, axis]):
                    continue
                rows = zip(at[pick], forces[pick, axis], ours[pick], strict=True)
                points = [Point(f"{t:.3f} s", float(one), float(two)) for t, one, two in rows]
                yield Series(scene.name, source + suffix, "program", f"force along E{axis + 1} [N]", points)


def shared_yield(bearing: Bearing) -> list[float]:
    """Yield displacements with which every surface moves the top plate by half of that of the element [m]."""
    links = sorted(series_links(bearing, rims=True, arms=False), key=lambda link: link.surface)
    half = max(LEAST_YIELD, min(link.yielding for link in links)) / 2
    surfaces = bearing.surfaces
    return [half * one.yield_displacement / link.yielding for one, link in zip(surfaces, links, strict=True)]


def here() -> Iterator[Series]:
    """All series that need no other program."""
    for part in (mastodon_shear, mastodon_seismic, sliding_block, circle_with_friction, device_points):
        yield from part()
