"""modelDescription.xml of a unit, its units of measure, and the list of its sources, in FMI 2.0 and 3.0."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

from msfp_gen.fmu.variables import Block, Variable
from msfp_gen.version import __version__

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
_CAUSALITY = {Block.TIME: "independent", Block.INPUTS: "input", Block.OUTPUTS: "output"}
_PARAMETERS = (Block.PARAMETERS, Block.BOOLEANS)


@dataclass(frozen=True)
class Unit:
    """What the descriptions say of a unit. kinds: "CoSimulation", "ModelExchange". sources: its C files."""

    name: str
    identifier: str
    token: str
    text: str
    kinds: tuple[str, ...]
    tolerance: float
    variables: Sequence[Variable]
    sources: Sequence[str]

    def at(self, *blocks: Block) -> list[int]:
        """Value references of the variables in some blocks."""
        return [i for i, variable in enumerate(self.variables) if variable.block in blocks]


def model_description(unit: Unit, version: int) -> bytes:
    """The text of modelDescription.xml. version: 2 or 3, of FMI."""
    root = Xml.Element("fmiModelDescription", fmiVersion=f"{version}.0", modelName=unit.name)
    root.set("guid" if version == 2 else "instantiationToken", unit.token)
    root.set("description", unit.text)
    root.set("version", __version__)
    root.set("generationTool", f"msfp-gen {__version__}")
    root.set("variableNamingConvention", "structured")
    if version == 2 and "ModelExchange" in unit.kinds:
        root.set("numberOfEventIndicators", str(len(unit.at(Block.GAPS))))
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


def build_description(unit: Unit) -> bytes:
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


def _interface(root: Xml.Element, unit: Unit, kind: str, version: int) -> None:
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


def _units(root: Xml.Element, unit: Unit) -> None:
    definitions = Xml.SubElement(root, "UnitDefinitions")
    for name in dict.fromkeys(variable.unit for variable in unit.variables):
        exponents = base_units(name) if name != "-" else None
        if exponents is not None:
            base = Xml.SubElement(Xml.SubElement(definitions, "Unit", name=name), "BaseUnit")
            for base_unit, power in exponents.items():
                base.set(base_unit, str(power))
            if name == CELSIUS:
                base.set("offset", repr(OFFSET))


def _attributes(variable: Variable) -> dict[str, str]:
    """Attributes that FMI 2.0 and 3.0 have in common, but for the type."""
    attributes = {"causality": _CAUSALITY.get(variable.block, "local"), "variability": "continuous"}
    if variable.block in _PARAMETERS:
        attributes = {"causality": "parameter", "variability": "fixed", "initial": "exact"}
    elif variable.block not in (Block.TIME, Block.INPUTS):
        attributes["initial"] = "calculated"
    known = variable.unit != "-" and base_units(variable.unit) is not None
    note = "" if known or variable.unit == "-" else f" [{variable.unit}]"
    return {"description": variable.meaning + note, **attributes}


def _numbers(variable: Variable) -> dict[str, str]:
    numbers = {}
    if variable.unit != "-" and base_units(variable.unit) is not None:
        numbers["unit"] = variable.unit
    if variable.block in (Block.INPUTS, *_PARAMETERS):
        numbers["start"] = repr(variable.start)
    if variable.nominal != 1.0:
        numbers["nominal"] = repr(variable.nominal)
    return numbers


def _variable2(variables: Xml.Element, reference: int, variable: Variable) -> None:
    attributes = {"name": variable.name, "valueReference": str(reference), **_attributes(variable)}
    element = Xml.SubElement(variables, "ScalarVariable", attributes)
    if variable.block is Block.BOOLEANS:
        Xml.SubElement(element, "Boolean", start=str(bool(variable.start)).lower())
        return
    real = Xml.SubElement(element, "Real", _numbers(variable))
    if variable.of is not None:
        real.set("derivative", str(variable.of + 1))


def _variable3(variables: Xml.Element, reference: int, variable: Variable) -> None:
    attributes = {"name": variable.name, "valueReference": str(reference), **_attributes(variable)}
    if variable.block is Block.BOOLEANS:
        Xml.SubElement(variables, "Boolean", attributes, start=str(bool(variable.start)).lower())
        return
    element = Xml.SubElement(variables, "Float64", attributes | _numbers(variable))
    if variable.of is not None:
        element.set("derivative", str(variable.of))


def _structure2(structure: Xml.Element, unit: Unit) -> None:
    lists = {
        "Outputs": unit.at(Block.OUTPUTS),
        "Derivatives": unit.at(Block.DERIVATIVES),
        "InitialUnknowns": unit.at(Block.OUTPUTS, Block.STATES, Block.DERIVATIVES),
    }
    for name, references in lists.items():
        if references:
            element = Xml.SubElement(structure, name)
            for reference in references:
                Xml.SubElement(element, "Unknown", index=str(reference + 1))


def _structure3(structure: Xml.Element, unit: Unit) -> None:
    lists = {
        "Output": unit.at(Block.OUTPUTS),
        "ContinuousStateDerivative": unit.at(Block.DERIVATIVES),
        "InitialUnknown": unit.at(Block.OUTPUTS, Block.STATES, Block.DERIVATIVES),
        "EventIndicator": unit.at(Block.GAPS),
    }
    # Some importers need the dependencies of all.
    knowns, initial = (
        " ".join(map(str, unit.at(*blocks)))
        for blocks in ((Block.INPUTS, Block.STATES), (Block.INPUTS, Block.PARAMETERS))
    )
    for name, references in lists.items():
        for reference in references:
            element = Xml.SubElement(structure, name, valueReference=str(reference))
            if name != "EventIndicator":
                element.set("dependencies", initial if name == "InitialUnknown" else knowns)
