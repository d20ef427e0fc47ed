"""The variables of a unit, in the order of their value references, and its modelDescription.xml, in FMI 2.0 and 3.0.

The list of its sources is there too. An importer sets and reads the variables.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from xml.etree import ElementTree as Xml

from msfp_gen.common.version import __version__
from msfp_gen.generator.interface import surface_values
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
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


class ReferenceBlock(StrEnum):
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
class UnitVariable:
    """One variable. start: of inputs, parameters and the time. nominal: its natural size. of: reference of the state.

    place: name of its value reference in C, where the C code uses it.
    """

    name: str
    block: ReferenceBlock
    unit: str
    meaning: str
    start: float = 0.0
    nominal: float = 1.0
    of: int | None = None
    place: str = ""


def variables(scene: Scene, exchange: bool) -> list[UnitVariable]:
    """All variables of the unit of a scene with a rig (motion in, wrench out) or a mass (force in, motion out).

    exchange: with the states of Model Exchange. The index of a variable is its value reference.
    """
    loaded = not isinstance(scene.top, RigTop)
    result = [UnitVariable("time", ReferenceBlock.TIME, "s", "time")]
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
            UnitVariable(
                f"der({x.name})", ReferenceBlock.DERIVATIVES, f"{x.unit}/s", f"rate of: {x.meaning}", of=first + i
            )
            for i, x in enumerate(states)
        ]
        if scene.spec.effects.rims:
            result += _gaps(scene.bearing.layout.surfaces)
    meaning = (
        "false: inputs are those at the begin of a step, from which the unit goes on with accelerations that change as "
        "since the last communication point; true: they are those at its end"
    )
    return [
        *result,
        UnitVariable("inputs_at_step_end", ReferenceBlock.BOOLEANS, "-", meaning, place="INPUTS_AT_STEP_END"),
    ]


def _vector(name: str, block: ReferenceBlock, unit: str, meaning: str, nominal: float = 1.0) -> Iterator[UnitVariable]:
    for i, axis in enumerate(AXES):
        yield UnitVariable(f"{name}[{i + 1}]", block, unit, f"{meaning} {axis}", nominal=nominal)


def _motion(end: str, meaning: str) -> Iterator[UnitVariable]:
    for name, (suffix, per, word) in zip(_DISPLACEMENTS, _ORDERS, strict=True):
        sizes = {"": (0.1, 0.01), "_rate": (0.1, 0.01), "_acceleration": (1.0, 0.1)}[suffix]
        yield from _vector(f"{end}.{name}", ReferenceBlock.INPUTS, f"m{per}", f"{name} of {meaning}, along", sizes[0])
        text = f"{word}rotation vector of {meaning}, along"
        yield from _vector(f"{end}.rotation{suffix}", ReferenceBlock.INPUTS, f"rad{per}", text, sizes[1])


def _load() -> Iterator[UnitVariable]:
    for suffix, per, word in _ORDERS:
        text = "on the top plate at its centre, beside the weight, along"
        yield from _vector(f"top.load{suffix}", ReferenceBlock.INPUTS, f"N{per}", f"{word}force {text}", 1e4)
        yield from _vector(f"top.load_moment{suffix}", ReferenceBlock.INPUTS, f"N m{per}", f"{word}moment {text}", 1e4)


def _outputs() -> Iterator[UnitVariable]:
    for end in ("lower", "upper"):
        text = f"that the {end} end exerts on the bearing"
        yield from _vector(f"{end}.force", ReferenceBlock.OUTPUTS, "N", f"force {text}, along")
        yield from _vector(
            f"{end}.moment", ReferenceBlock.OUTPUTS, "N m", f"moment {text}, about its present position, along"
        )


def _outputs_loaded() -> Iterator[UnitVariable]:
    for name, (suffix, per, word) in zip(_DISPLACEMENTS, _ORDERS, strict=True):
        text = f"{name} of the centre of the top plate since the start, along"
        yield from _vector(f"top.{name}", ReferenceBlock.OUTPUTS, f"m{per}", text)
        for i, angle in enumerate(("psi", "theta", "phi")):
            meaning = f"{word}angle {angle} (2.1) of the top plate"
            yield UnitVariable(f"top.angle{suffix}[{i + 1}]", ReferenceBlock.OUTPUTS, f"rad{per}", meaning)
    yield from _vector("top.force", ReferenceBlock.OUTPUTS, "N", "force of the bearing on the supported mass, along")
    yield from _vector("lower.force", ReferenceBlock.OUTPUTS, "N", "force on the body above the lowest surface, along")


def _surface_outputs(count: int) -> Iterator[UnitVariable]:
    for name, unit, meaning in (("sliding", "m", "sliding displacement (3.20)"), ("normal", "N", "normal force")):
        for j in range(count):
            yield UnitVariable(
                f"surface[{j + 1}].{name}", ReferenceBlock.OUTPUTS, unit, f"{meaning} of surface {j + 1}"
            )


def _gaps(count: int) -> Iterator[UnitVariable]:
    for j in range(1, count + 1):
        yield UnitVariable(
            f"surface[{j}].gap", ReferenceBlock.GAPS, "m", f"gap to the rim (3.21) of surface {j}", nominal=1e-3
        )


def top_names(scene: Scene) -> tuple[str, ...]:
    """Numbers of the top that are parameters, in order."""
    return _RIG if isinstance(scene.top, RigTop) else _MASS


def _parameters(scene: Scene) -> Iterator[UnitVariable]:
    spec, solver = scene.spec, scene.solver
    bodies, surfaces = bodies_and_surfaces(scene.bearing, spec.effects, scene.top)
    yield UnitVariable("gravity", ReferenceBlock.PARAMETERS, "m/s^2", "gravity", scene.bearing.gravity, place="GRAVITY")
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
        yield UnitVariable(
            "axial_load", ReferenceBlock.PARAMETERS, "N", meaning, scene.top.axial_load, place="AXIAL_LOAD"
        )
    for name, unit, meaning, value in (
        ("rtol", "-", "bound of the relative error of a step", solver.rtol),
        ("angle_tolerance", "rad", "bound of the absolute error of a step; 0: rtol/100", solver.atol_angle or 0.0),
        ("max_step", "s", "longest step; 0: chosen", solver.max_step or 0.0),
        ("max_steps", "-", "largest number of steps in a communication step", float(solver.max_steps)),
    ):
        yield UnitVariable(
            f"solver.{name}", ReferenceBlock.PARAMETERS, unit, meaning, value, place=f"SOLVER_{name.upper()}"
        )


def _values(
    prefix: str, values: Sequence[Value], numbers: Sequence[float], place: str, of: str
) -> Iterator[UnitVariable]:
    for i, (value, number) in enumerate(zip(values, numbers, strict=True)):
        meaning = f"{value.meaning}, {of}" if of else value.meaning
        at = place if i == 0 else ""
        yield UnitVariable(
            f"{prefix}.{value.name}", ReferenceBlock.PARAMETERS, value.unit, meaning, float(number), place=at
        )


def _states(scene: Scene) -> Iterator[UnitVariable]:
    """Coordinates and rates of the bodies, then Y and Z."""
    count = scene.bearing.layout.surfaces
    for suffix, per, word, size in (("", "", "", 1e-2), ("_rate", "/s", "rate of the ", 0.1)):
        for k in range(2, count + 2):
            for angle in ("psi", "theta", "phi"):
                name, meaning = f"body[{k}].{angle}{suffix}", f"{word}angle {angle} of body {k}"
                yield UnitVariable(name, ReferenceBlock.STATES, f"rad{per}", meaning, nominal=size)
    for j in range(1, count + 1):
        for letter in "YZ":
            name, meaning = f"surface[{j}].{letter}", f"friction state {letter} of surface {j}"
            yield UnitVariable(name, ReferenceBlock.STATES, "-", meaning)


# Exponents of kg, m, s, K, rad.
BASE = ("kg", "m", "s", "K", "rad")
_KNOWN = {
    "kg": (1, 0, 0, 0, 0),
    "m": (0, 1, 0, 0, 0),
    "s": (0, 0, 1, 0, 0),
    "K": (0, 0, 0, 1, 0),
    "rad": (0, 0, 0, 0, 1),
    "N": (1, 1, -2, 0, 0),
    "J": (1, 2, -2, 0, 0),
    "W": (1, 2, -3, 0, 0),
    "Pa": (1, -1, -2, 0, 0),
}
CELSIUS = "degC"
OFFSET = 273.15  # of degC from K
_FACTOR = re.compile(r"([A-Za-z]+)(?:\^(\d+))?")


def base_units(unit: str) -> dict[str, int] | None:
    """Base unit -> exponent other than 0, of a unit such as "N m/rad" or "kg m^2"; None where it is no unit of FMI.

    Factors are separated by spaces; all after a slash divide, also after a second one.
    """
    if unit == CELSIUS:
        return {"K": 1}
    total = [0] * len(BASE)
    for i, part in enumerate(unit.split("/")):
        for factor in part.split():
            match = _FACTOR.fullmatch(factor)
            if factor == "1":
                continue
            if match is None or match[1] not in _KNOWN:
                return None
            sign = (-1 if i else 1) * int(match[2] or 1)
            total = [have + sign * exponent for have, exponent in zip(total, _KNOWN[match[1]], strict=True)]
    return {name: power for name, power in zip(BASE, total, strict=True) if power}


CATEGORIES = {"logStatusDiscard": "states refused", "logStatusError": "errors"}
STEP = 0.01  # communication step that is suggested [s]
_CAUSALITY = {ReferenceBlock.TIME: "independent", ReferenceBlock.INPUTS: "input", ReferenceBlock.OUTPUTS: "output"}
_PARAMETERS = (ReferenceBlock.PARAMETERS, ReferenceBlock.BOOLEANS)


@dataclass(frozen=True)
class UnitDescription:
    """What the descriptions say of a unit. kinds: "CoSimulation", "ModelExchange". sources: its C files."""

    name: str
    identifier: str
    token: str
    text: str
    kinds: tuple[str, ...]
    tolerance: float
    variables: Sequence[UnitVariable]
    sources: Sequence[str]

    def at(self, *blocks: ReferenceBlock) -> list[int]:
        """Value references of the variables in some blocks."""
        return [i for i, variable in enumerate(self.variables) if variable.block in blocks]


def model_description(unit: UnitDescription, version: int) -> bytes:
    """The text of modelDescription.xml. version: 2 or 3, of FMI."""
    root = Xml.Element("fmiModelDescription", fmiVersion=f"{version}.0", modelName=unit.name)
    root.set("guid" if version == 2 else "instantiationToken", unit.token)
    root.set("description", unit.text)
    root.set("version", __version__)
    root.set("generationTool", f"msfp-gen {__version__}")
    root.set("variableNamingConvention", "structured")
    if version == 2 and "ModelExchange" in unit.kinds:
        root.set("numberOfEventIndicators", str(len(unit.at(ReferenceBlock.GAPS))))
    for kind in unit.kinds:
        _interface(root, unit, kind, version)
    _units(root, unit)
    categories = Xml.SubElement(root, "LogCategories")
    for name, meaning in CATEGORIES.items():
        Xml.SubElement(categories, "Category", name=name, description=meaning)
    Xml.SubElement(root, "DefaultExperiment", tolerance=repr(unit.tolerance), stepSize=repr(STEP))
    variables = Xml.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(unit.variables):
        (_variable2 if version == 2 else _variable3)(variables, reference, variable)
    (_structure2 if version == 2 else _structure3)(Xml.SubElement(root, "ModelStructure"), unit)
    return _text(root)


def build_description(unit: UnitDescription) -> bytes:
    """The text of sources/buildDescription.xml of FMI 3.0."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    build = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    files = Xml.SubElement(build, "SourceFileSet", language="C99")
    for name in unit.sources:
        Xml.SubElement(files, "SourceFile", name=name)
    return _text(root)


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _interface(root: Xml.Element, unit: UnitDescription, kind: str, version: int) -> None:
    element = Xml.SubElement(root, kind, modelIdentifier=unit.identifier)
    element.set("canGetAndSetFMUstate" if version == 2 else "canGetAndSetFMUState", "true")
    element.set("canSerializeFMUstate" if version == 2 else "canSerializeFMUState", "true")
    if version == 2:
        element.set("canNotUseMemoryManagementFunctions", "true")
        element.set("providesDirectionalDerivative", "true")
    else:
        element.set("providesDirectionalDerivatives", "true")
        element.set("providesAdjointDerivatives", "true")
    if kind == "CoSimulation":
        element.set("canHandleVariableCommunicationStepSize", "true")
    elif version == 2:
        element.set("completedIntegratorStepNotNeeded", "true")
    if version == 2:
        files = Xml.SubElement(element, "SourceFiles")
        for name in unit.sources:
            Xml.SubElement(files, "File", name=name)


def _units(root: Xml.Element, unit: UnitDescription) -> None:
    definitions = Xml.SubElement(root, "UnitDefinitions")
    for name in dict.fromkeys(variable.unit for variable in unit.variables):
        exponents = base_units(name) if name != "-" else None
        if exponents is not None:
            base = Xml.SubElement(Xml.SubElement(definitions, "Unit", name=name), "BaseUnit")
            for base_unit, power in exponents.items():
                base.set(base_unit, str(power))
            if name == CELSIUS:
                base.set("offset", repr(OFFSET))


def _attributes(variable: UnitVariable) -> dict[str, str]:
    """Attributes that FMI 2.0 and 3.0 have in common, but for the type."""
    attributes = {"causality": _CAUSALITY.get(variable.block, "local"), "variability": "continuous"}
    if variable.block in _PARAMETERS:
        attributes = {"causality": "parameter", "variability": "fixed", "initial": "exact"}
    elif variable.block not in (ReferenceBlock.TIME, ReferenceBlock.INPUTS):
        attributes["initial"] = "calculated"
    known = variable.unit != "-" and base_units(variable.unit) is not None
    note = "" if known or variable.unit == "-" else f" [{variable.unit}]"
    return {"description": variable.meaning + note, **attributes}


def _numbers(variable: UnitVariable) -> dict[str, str]:
    numbers = {}
    if variable.unit != "-" and base_units(variable.unit) is not None:
        numbers["unit"] = variable.unit
    if variable.block in (ReferenceBlock.INPUTS, *_PARAMETERS):
        numbers["start"] = repr(variable.start)
    if variable.nominal != 1.0:
        numbers["nominal"] = repr(variable.nominal)
    return numbers


def _variable2(variables: Xml.Element, reference: int, variable: UnitVariable) -> None:
    attributes = {"name": variable.name, "valueReference": str(reference), **_attributes(variable)}
    element = Xml.SubElement(variables, "ScalarVariable", attributes)
    if variable.block is ReferenceBlock.BOOLEANS:
        Xml.SubElement(element, "Boolean", start=str(bool(variable.start)).lower())
        return
    real = Xml.SubElement(element, "Real", _numbers(variable))
    if variable.of is not None:
        real.set("derivative", str(variable.of + 1))


def _variable3(variables: Xml.Element, reference: int, variable: UnitVariable) -> None:
    attributes = {"name": variable.name, "valueReference": str(reference), **_attributes(variable)}
    if variable.block is ReferenceBlock.BOOLEANS:
        Xml.SubElement(variables, "Boolean", attributes, start=str(bool(variable.start)).lower())
        return
    element = Xml.SubElement(variables, "Float64", attributes | _numbers(variable))
    if variable.of is not None:
        element.set("derivative", str(variable.of))


def _structure2(structure: Xml.Element, unit: UnitDescription) -> None:
    lists = {
        "Outputs": unit.at(ReferenceBlock.OUTPUTS),
        "Derivatives": unit.at(ReferenceBlock.DERIVATIVES),
        "InitialUnknowns": unit.at(ReferenceBlock.OUTPUTS, ReferenceBlock.STATES, ReferenceBlock.DERIVATIVES),
    }
    for name, references in lists.items():
        if references:
            element = Xml.SubElement(structure, name)
            for reference in references:
                Xml.SubElement(element, "Unknown", index=str(reference + 1))


def _structure3(structure: Xml.Element, unit: UnitDescription) -> None:
    lists = {
        "Output": unit.at(ReferenceBlock.OUTPUTS),
        "ContinuousStateDerivative": unit.at(ReferenceBlock.DERIVATIVES),
        "InitialUnknown": unit.at(ReferenceBlock.OUTPUTS, ReferenceBlock.STATES, ReferenceBlock.DERIVATIVES),
        "EventIndicator": unit.at(ReferenceBlock.GAPS),
    }
    # Some importers need the dependencies of all.
    knowns, initial = (
        " ".join(map(str, unit.at(*blocks)))
        for blocks in (
            (ReferenceBlock.INPUTS, ReferenceBlock.STATES),
            (ReferenceBlock.INPUTS, ReferenceBlock.PARAMETERS),
        )
    )
    for name, references in lists.items():
        for reference in references:
            element = Xml.SubElement(structure, name, valueReference=str(reference))
            if name != "EventIndicator":
                element.set("dependencies", initial if name == "InitialUnknown" else knowns)
