"""The variables of a unit: what its importer sets and reads, in the order of their value references."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from msfp_gen.generator.interface import surface_values
from msfp_gen.model.evaluation import bodies_and_surfaces, top_values
from msfp_gen.scene.scene import Scene
from msfp_gen.scene.top import RigTop
from msfp_gen.specification import contract
from msfp_gen.specification.values import Value

AXES = ("E1", "E2", "E3")
# Orders of an input: suffixes of names for translations and for rotations, of units, and words.
_ORDERS = (("", "", ""), ("_rate", "/s", "rate of the "), ("_acceleration", "/s^2", "second derivative of the "))
_DISPLACEMENTS = ("displacement", "velocity", "acceleration")
_RIG = ("stiffness", "damping", "rotational_stiffness", "rotational_damping", "vertical_stiffness", "vertical_damping")
_MASS = (*_RIG[2:], "mass", "inertia_transverse", "inertia_axial", "height")


class Block(StrEnum):
    """Blocks of value references, in order; the name of a block in C is its value."""

    TIME = "TIME"
    INPUTS = "INPUTS"
    OUTPUTS = "OUTPUTS"
    PARAMETERS = "PARAMETERS"
    STATES = "CONTINUOUS"
    DERIVATIVES = "DERIVATIVES"
    GAPS = "GAPS"
    BOOLEANS = "BOOLEANS"


@dataclass(frozen=True)
class Variable:
    """One variable. start: of inputs, parameters and the time. nominal: its natural size. of: reference of the state.

    place: name of its value reference in C, where the C code uses it.
    """

    name: str
    block: Block
    unit: str
    meaning: str
    start: float = 0.0
    nominal: float = 1.0
    of: int | None = None
    place: str = ""


def variables(scene: Scene, exchange: bool) -> list[Variable]:
    """All variables of the unit of a scene with a rig (motion in, wrench out) or a mass (force in, motion out).

    exchange: with the states of Model Exchange. The index of a variable is its value reference.
    """
    loaded = not isinstance(scene.top, RigTop)
    result = [Variable("time", Block.TIME, "s", "time")]
    result += _motion("lower", "the lower end, which holds the base")
    result += _load() if loaded else _motion("upper", "the upper end, the far side of the interface")
    result += _outputs_loaded() if loaded else _outputs()
    result += _surface_outputs(scene.bearing.layout.surfaces)
    result += _parameters(scene)
    if exchange:
        states = list(_states(scene))
        first = len(result)
        result += states
        result += [
            Variable(f"der({x.name})", Block.DERIVATIVES, f"{x.unit}/s", f"rate of: {x.meaning}", of=first + i)
            for i, x in enumerate(states)
        ]
        if scene.spec.effects.rims:
            result += _gaps(scene.bearing.layout.surfaces)
    meaning = (
        "false: inputs are those at the begin of a step, from which the unit goes on with accelerations that change as "
        "since the last communication point; true: they are those at its end"
    )
    return [*result, Variable("inputs_at_step_end", Block.BOOLEANS, "-", meaning, place="INPUTS_AT_STEP_END")]


def _vector(name: str, block: Block, unit: str, meaning: str, nominal: float = 1.0) -> Iterator[Variable]:
    for i, axis in enumerate(AXES):
        yield Variable(f"{name}[{i + 1}]", block, unit, f"{meaning} {axis}", nominal=nominal)


def _motion(end: str, meaning: str) -> Iterator[Variable]:
    for name, (suffix, per, word) in zip(_DISPLACEMENTS, _ORDERS, strict=True):
        sizes = {"": (0.1, 0.01), "_rate": (0.1, 0.01), "_acceleration": (1.0, 0.1)}[suffix]
        yield from _vector(f"{end}.{name}", Block.INPUTS, f"m{per}", f"{name} of {meaning}, along", sizes[0])
        text = f"{word}rotation vector of {meaning}, along"
        yield from _vector(f"{end}.rotation{suffix}", Block.INPUTS, f"rad{per}", text, sizes[1])


def _load() -> Iterator[Variable]:
    for suffix, per, word in _ORDERS:
        text = "on the top plate at its centre, beside the weight, along"
        yield from _vector(f"top.load{suffix}", Block.INPUTS, f"N{per}", f"{word}force {text}", 1e4)
        yield from _vector(f"top.load_moment{suffix}", Block.INPUTS, f"N m{per}", f"{word}moment {text}", 1e4)


def _outputs() -> Iterator[Variable]:
    for end in ("lower", "upper"):
        text = f"that the {end} end exerts on the bearing"
        yield from _vector(f"{end}.force", Block.OUTPUTS, "N", f"force {text}, along")
        yield from _vector(f"{end}.moment", Block.OUTPUTS, "N m", f"moment {text}, about its present position, along")


def _outputs_loaded() -> Iterator[Variable]:
    for name, (suffix, per, word) in zip(_DISPLACEMENTS, _ORDERS, strict=True):
        text = f"{name} of the centre of the top plate since the start, along"
        yield from _vector(f"top.{name}", Block.OUTPUTS, f"m{per}", text)
        for i, angle in enumerate(("psi", "theta", "phi")):
            meaning = f"{word}angle {angle} (2.1) of the top plate"
            yield Variable(f"top.angle{suffix}[{i + 1}]", Block.OUTPUTS, f"rad{per}", meaning)
    yield from _vector("top.force", Block.OUTPUTS, "N", "force of the bearing on the supported mass, along")
    yield from _vector("lower.force", Block.OUTPUTS, "N", "force on the body above the lowest surface, along")


def _surface_outputs(count: int) -> Iterator[Variable]:
    for name, unit, meaning in (("sliding", "m", "sliding displacement (3.20)"), ("normal", "N", "normal force")):
        for j in range(count):
            yield Variable(f"surface[{j + 1}].{name}", Block.OUTPUTS, unit, f"{meaning} of surface {j + 1}")


def _gaps(count: int) -> Iterator[Variable]:
    for j in range(1, count + 1):
        yield Variable(f"surface[{j}].gap", Block.GAPS, "m", f"gap to the rim (3.21) of surface {j}", nominal=1e-3)


def top_names(scene: Scene) -> tuple[str, ...]:
    """Numbers of the top that are parameters, in order."""
    return _RIG if isinstance(scene.top, RigTop) else _MASS


def _parameters(scene: Scene) -> Iterator[Variable]:
    spec, solver = scene.spec, scene.solver
    bodies, surfaces = bodies_and_surfaces(scene.bearing, spec.effects, scene.top)
    yield Variable("gravity", Block.PARAMETERS, "m/s^2", "gravity", scene.bearing.gravity, place="GRAVITY")
    for k, row in enumerate(bodies):
        yield from _values(f"body[{k + 1}]", contract.BODY, row, "" if k else "BODIES", f"body {k + 1}")
    for j, row in enumerate(surfaces):
        place = "" if j else "SURFACE_VALUES"
        yield from _values(f"surface[{j + 1}]", surface_values(spec), row, place, f"surface {j + 1}")
    values_of_top = dict(zip(contract.names(contract.TOP), top_values(scene.top), strict=True))
    known = {value.name: value for value in contract.TOP}
    names = top_names(scene)
    word = "interface" if isinstance(scene.top, RigTop) else "top"
    yield from _values(word, [known[name] for name in names], [values_of_top[name] for name in names], "TOP_VALUES", "")
    if isinstance(scene.top, RigTop):
        meaning = "compression of the bearing while both ends are where they start"
        yield Variable("axial_load", Block.PARAMETERS, "N", meaning, scene.top.axial_load, place="AXIAL_LOAD")
    for name, unit, meaning, value in (
        ("rtol", "-", "bound of the relative error of a step", solver.rtol),
        ("angle_tolerance", "rad", "bound of the absolute error of a step; 0: rtol/100", solver.atol_angle or 0.0),
        ("max_step", "s", "longest step; 0: chosen", solver.max_step or 0.0),
        ("max_steps", "-", "largest number of steps in a communication step", float(solver.max_steps)),
    ):
        yield Variable(f"solver.{name}", Block.PARAMETERS, unit, meaning, value, place=f"SOLVER_{name.upper()}")


def _values(prefix: str, values: Sequence[Value], numbers: Sequence[float], place: str, of: str) -> Iterator[Variable]:
    for i, (value, number) in enumerate(zip(values, numbers, strict=True)):
        meaning = f"{value.meaning}, {of}" if of else value.meaning
        at = place if i == 0 else ""
        yield Variable(f"{prefix}.{value.name}", Block.PARAMETERS, value.unit, meaning, float(number), place=at)


def _states(scene: Scene) -> Iterator[Variable]:
    """Coordinates and rates of the bodies, then Y and Z."""
    count = scene.bearing.layout.surfaces
    for suffix, per, word, size in (("", "", "", 1e-2), ("_rate", "/s", "rate of the ", 0.1)):
        for k in range(2, count + 2):
            for angle in ("psi", "theta", "phi"):
                name, meaning = f"body[{k}].{angle}{suffix}", f"{word}angle {angle} of body {k}"
                yield Variable(name, Block.STATES, f"rad{per}", meaning, nominal=size)
    for j in range(1, count + 1):
        for letter in "YZ":
            name, meaning = f"surface[{j}].{letter}", f"friction state {letter} of surface {j}"
            yield Variable(name, Block.STATES, "-", meaning)
