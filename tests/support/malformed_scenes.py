"""Malformed scene files and the words that the message about each must hold."""

from __future__ import annotations

import copy
import math
import tomllib

from msfp_gen import presets
from msfp_gen.scene.file.loader import scene_text

GOOD = tomllib.loads(scene_text(presets.scene("fenz-test2")))
ABSENT = object()
RECORD = {"kind": "record", "bundled": "ridgecrest-2019-ci-ccc"}
# path, value put there (ABSENT: removed), words that the message must hold
ROWS = [
    # unknown and misspelt keys
    ("bering", 1, ("bering: unknown key", "did you mean 'bearing'?")),
    ("wibble", 1, ("wibble: unknown key", "the keys here are", "motion")),
    ("bearing.surfaces.2.radus", 0.076, ("bearing.surfaces[2].radus (surface 3): unknown key", "'radius'")),
    ("bearing.bodies.0.colour", 4.4, ("bearing.bodies[0].colour (body 2): unknown key", "mass")),
    ("bearing.layout.k", 4, ("bearing.layout.k: unknown key", "n, m, p")),
    ("motion.amplitud", 0.1, ("motion.amplitud: unknown key", "'amplitude'")),
    ("motion.held", 20.0, ("motion.held: unknown key", "did you mean 'hold'?")),
    ("top.stifness", 1e8, ("top.stifness: unknown key", "'stiffness'")),
    ("effects.rim", True, ("effects.rim: unknown key", "'rims'")),
    ("solver.tol", 1e-4, ("solver.tol: unknown key", "'rtol'")),
    ("stop", {"displacment": 0.1}, ("stop.displacment: unknown key", "'displacement'")),
    ("bearing", {"preset": "fenz-tfp", "frictions": 0.1}, ("bearing.frictions: unknown key", "'friction'")),
    # missing keys
    ("bearing", ABSENT, ("bearing is missing",)),
    ("motion", ABSENT, ("motion is missing",)),
    ("top", ABSENT, ("top is missing",)),
    ("bearing.surfaces.2.radius", ABSENT, ("bearing.surfaces[2].radius (surface 3) is missing", "above 0 [m]")),
    ("bearing.bodies.3.mass", ABSENT, ("bearing.bodies[3].mass (body 5) is missing", "[kg]")),
    ("bearing.base_height", ABSENT, ("bearing.base_height is missing", "[m]")),
    ("bearing.layout.m", ABSENT, ("bearing.layout.m is missing", "whole number")),
    ("motion.kind", ABSENT, ("motion.kind is missing", "'harmonic'", "'record'")),
    ("motion.frequency", ABSENT, ("motion.frequency is missing", "[Hz]")),
    ("top.kind", ABSENT, ("top.kind is missing", "'rig'")),
    ("top.axial_load", ABSENT, ("top.axial_load is missing", "[N]")),
    # wrong kinds of value
    ("bearing", 3, ("bearing = 3", "table or the name of a preset")),
    ("bearing.surfaces", 3, ("bearing.surfaces = 3", "list of tables")),
    ("bearing.surfaces.1", 0.076, ("bearing.surfaces[1] = 0.076 (surface 2)", "table")),
    ("bearing.layout", [5, 2, 2], ("bearing.layout = [5, 2, 2]", "table")),
    ("motion", "circle", ("motion = 'circle'", "table")),
    ("motion.kind", "circel", ("motion.kind = 'circel'", "'circle'")),
    ("motion.kind", 3, ("motion.kind = 3", "'circle'")),
    ("top.kind", "fixed", ("top.kind = 'fixed'", "'rig'", "'mass'")),
    ("effects", [1], ("effects = [1]", "table")),
    ("name", 7, ("name = 7", "text")),
    ("bearing.surfaces.0.friction", True, ("bearing.surfaces[0].friction = True", "number")),
    ("bearing.layout.n", 5.0, ("bearing.layout.n = 5.0", "whole number")),
    ("solver.max_steps", 1e6, ("solver.max_steps = 1000000.0", "whole number")),
    ("effects.spin", "fixed", ("effects.spin = 'fixed'", "'locked'", "'patch'", "'free'")),
    ("effects.rims", "yes", ("effects.rims = 'yes'", "True, False")),
    ("top", {"kind": "prescribed", "force": [0, 0]}, ("top.force = [0, 0]", "3 finite numbers [N]")),
    # shorter than any step
    ("motion.frequency", 1e16, ("duration = ", "no step is shorter than 1e-09 s", "slower motion")),
    # wrong units
    ("bearing.surfaces.0.radius", "473 kg", ("bearing.surfaces[0].radius = '473 kg' (surface 1)", "[m]")),
    ("bearing.surfaces.0.radius", "473", ("bearing.surfaces[0].radius = '473'", "names no unit", "[m]")),
    ("bearing.surfaces.0.friction", "3 mm", ("friction = '3 mm'", "no unit")),
    ("bearing.gravity", "1 gram", ("bearing.gravity = '1 gram'", "[m/s^2]")),
    ("top.axial_load", "112 kg", ("top.axial_load = '112 kg'", "'kg' is not a unit of [N]")),
    ("top.axial_load", "1 g", ("top.axial_load = '1 g'", "[N]")),
    ("top.stiffness", "1e8 N m/rad", ("top.stiffness = '1e8 N m/rad'", "[N/m]")),
    ("motion.frequency", "0.04 rad/s", ("motion.frequency = '0.04 rad/s'", "[Hz]")),
    ("motion.amplitude", "25 milimetre", ("motion.amplitude = '25 milimetre'", "unknown", "[m]")),
    ("motion.amplitude", "__import__('os').getcwd()", ("motion.amplitude = ", "no number")),
    ("duration", "5 Hz", ("duration = '5 Hz'", "[s]")),
    # numbers out of range, NaN and infinity
    ("bearing.surfaces.0.radius", -0.473, ("bearing.surfaces[0].radius = -0.473 (surface 1)", "above 0 [m]")),
    ("bearing.surfaces.3.radius", math.nan, ("bearing.surfaces[3].radius = nan", "finite")),
    ("bearing.surfaces.3.capacity", math.inf, ("bearing.surfaces[3].capacity = inf", "finite")),
    ("bearing.surfaces.0.friction", -0.01, ("bearing.surfaces[0].friction = -0.01", "not below 0")),
    ("bearing.surfaces.0.yield_displacement", 0, ("bearing.surfaces[0].yield_displacement = 0", "above 0 [m]")),
    ("bearing.bodies.1.height", -0.046, ("bearing.bodies[1].height = -0.046 (body 3)", "above 0 [m]")),
    ("bearing.bodies.1.mass", 0, ("bearing.bodies[1].mass = 0 (body 3)", "above 0 [kg]")),
    ("bearing.bodies.1.inertia", [1e-4, 0], ("bearing.bodies[1].inertia = [0.0001, 0]", "above 0 [kg m^2]")),
    ("motion.amplitude", 0, ("motion.amplitude = 0", "above 0 [m]")),
    ("motion.cycles", -1, ("motion.cycles = -1", "above 0")),
    ("top.axial_load", -112e3, ("top.axial_load = -112000.0", "not below 0 [N]")),
    ("solver.rtol", 0, ("solver.rtol = 0", "above 0")),
    ("solver.rtol", 2, ("solver.rtol = 2", "below 1")),
    ("duration", 0, ("duration = 0", "above 0 [s]")),
    ("output_step", -1, ("output_step = -1", "above 0 [s]")),
    ("stop", {"displacement": 0}, ("stop.displacement = 0", "above 0 [m]")),
    # wrong counts
    ("bearing.layout.p", 3, ("bearing.layout.n = 5", "n = m + p + 1")),
    ("bearing.layout.n", 1, ("bearing.layout.n = 1", "at least 2")),
    ("bearing.layout", {"n": 3, "m": 1, "p": 1}, ("bearing.surfaces has 4 entries", "needs 2")),
    ("bearing.surfaces", [], ("bearing.surfaces has 0 entries", "needs 4")),
    ("bearing", {"preset": "fenz-tfp", "friction": [0.1, 0.2]}, ("bearing.friction has 2 entries: give 4",)),
    # impossible geometry
    ("bearing.surfaces.1.capacity", 0.12, ("bearing.surfaces[1].capacity = 0.12 (surface 2)", "quarter turn")),
    ("bearing.surfaces.1.capacity", 0.1, ("bearing.surfaces[1].capacity = 0.1 (surface 2)", "hemisphere")),
    ("bearing.bodies.1.rim_radius", 0.08, ("bearing.bodies[1].rim_radius = 0.08 (body 3)", "radius of the surface")),
    ("bearing.bodies.1.centroid", 0.05, ("bearing.bodies[1].centroid = 0.05", "height of the body, 0.046")),
    ("bearing.bodies.1.inertia", [1e-4, 3e-4], ("bearing.bodies[1].inertia", "twice its transverse")),
    ("bearing.bodies.0.rim_radius", 0, ("bearing.bodies[0].rim_radius = 0 (body 2)", "effects.rims = false")),
    # parts that do not fit together, and things that are not there
    ("bearing", "fenz-tpf", ("bearing = 'fenz-tpf'", "did you mean 'fenz-tfp'?")),
    ("bearing", {"preset": 3}, ("bearing.preset = 3", "text")),
    ("bearing", {"preset": "fenz-tfp", "friction": [0.1, -1, 0.1, 0.1]}, ("bearing.friction", "not below 0")),
    ("bearing", {"preset": "fenz-tfp", "centroid": 0.02}, ("bearing.bodies[0].centroid = 0.02", "at most the height")),
    ("effects", {"sliders": "massless", "spin": "free"}, ("effects.spin = 'free'", "'patch'")),
    ("duration", 1e4, ("duration = 10000.0", "motion.hold")),
    ("output_step", 100.0, ("output_step = 100.0", "at most the duration")),
    ("stop", {}, ("stop: nothing to stop at",)),
    ("initial_state", {"q": [[0, 0, 0]], "v": [[0, 0, 0]], "h": [[0, 0]]}, ("initial_state.q has 1 rows", "4")),
    ("initial_state", {"q": 0, "v": [], "h": []}, ("initial_state.q = 0", "lists of 3")),
    ("motion", {"kind": "record"}, ("motion.file and motion.bundled", "give one")),
    ("motion", RECORD | {"file": "a.v1"}, ("motion.file and motion.bundled: both",)),
    ("motion", {"kind": "record", "bundled": "kobe"}, ("motion.bundled", "'kobe'", "ridgecrest-2019-ci-ccc")),
    ("motion", {"kind": "record", "file": "gone.v1"}, ("motion.file", "gone.v1", "no such file")),
    ("motion", {"kind": "arrays", "file": "gone.csv"}, ("motion.file", "gone.csv", "no such file")),
    ("motion", {"kind": "arrays", "file": 3}, ("motion.file = 3", "text")),
    ("motion", {"kind": "ramp", "acceleration": 1, "duration": 1, "hold": 1}, ("motion.held", "end it at rest")),
    ("motion", {"kind": "pieces", "knots": [0, 1], "coefficients": [1]}, ("motion.coefficients = [1]", "lists of 6")),
]


def broken(path, value):
    table = copy.deepcopy(GOOD)
    *parents, last = path.split(".")
    inner = table
    for part in parents:
        inner = inner[int(part) if isinstance(inner, list) else part]
    key = int(last) if isinstance(inner, list) else last
    if value is ABSENT:
        del inner[key]
    else:
        inner[key] = value
    return table
