"""The public C interface: its header, and what it states about a model: names, lists of numbers, texts and checks.

The header is the only description of its types and functions: its text is read to declare them in Cython and, by
`embedding/fortran.py`, in Fortran.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from math import inf
from typing import TYPE_CHECKING, Any

from msfp_gen.common.version import __version__
from msfp_gen.specification import contract
from msfp_gen.specification.friction_laws import HEAT_KERNEL, LONGEST
from msfp_gen.specification.values import Value

if TYPE_CHECKING:
    from importlib.abc import Traversable  # in Python 3.14 importlib.resources.abc alone

    from jinja2 import Environment

    from msfp_gen.specification.layout import ModelSpec
    from msfp_gen.specification.values import Bound

ABI_VERSION = 4
CALL_ERRORS = (  # what calls return beside the statuses of a run: name, meaning and remedy
    ("argument", "an argument is missing or out of range; `message` names it"),
    ("snapshot", "these bytes are no snapshot of this model with these inputs by this build"),
)
# A function declared in a header of the runtime: the line begins with its type.
_PROTOTYPE = re.compile(r"^(?!static\b|typedef\b)[A-Za-z_][\w \t*]*?\b(msfp_\w+)\(", re.MULTILINE)
# Words of the Python interface in the texts of statuses -> those of the C interface.
_WORDS = (
    (" (docs/model.md)", ""),
    ("give effects.uplift = true", "export the model with --uplift"),
    ("solver.method = 'implicit'", "method = MSFP_METHOD_IMPLICIT"),
    ("solver.", ""),
)


def model_name(spec: ModelSpec) -> str:
    """Name of a model and prefix of its external names in C, `msfp_<n>_<m>_<p>`."""
    return f"msfp_{spec.layout.name}"


def runtime_symbols() -> list[str]:
    """Functions that the headers of the runtime declare, in alphabetical order."""
    headers = _files(resources.files("msfp_gen.runtime"), ".h")
    return sorted({name for file in headers for name in _PROTOTYPE.findall(file.read_text(encoding="utf-8"))})


def surface_values(spec: ModelSpec) -> list[Value]:
    """The values of a surface in order, those of its friction law and drilling moment included."""
    known = {value.name: value for value in contract.EVERY_SURFACE}
    return [(known | contract.NUMBERS)[name] for name in contract.surface_values(spec.effects)]


def effects_text(spec: ModelSpec) -> str:
    """The effects of a model in one line."""
    e = spec.effects
    law = f" (mu = {e.law.text})" if e.law is not None else ""
    switches = {field.name: on for field in fields(e) if isinstance(on := getattr(e, field.name), bool)}
    words = [f"dimension {e.dimension}", f"spin {e.spin}", f"sliders {e.sliders}"]
    words += [f"{name} {'on' if on else 'off'}" for name, on in switches.items()]
    return ", ".join([*words, f"hysteresis law {e.bouc_wen}", f"friction {e.friction}{law}"])


def text_in_c(status: contract.Status) -> str:
    """Meaning and remedy of a status in the words of the C interface."""
    text = status.failure or status.meaning
    for word, instead in _WORDS:
        text = text.replace(word, instead)
    return text


def interface_context(spec: ModelSpec, shape: Any, header: str) -> dict[str, Any]:
    """Variables of the templates of the public interface. shape: of a quantity in numbers; header: text of `msfp.h`."""
    symbols = runtime_symbols()
    lists = {"row": contract.row(spec.effects), "extremes": contract.extremes(spec.effects)}
    meanings = {"row": "One row of output", "extremes": "Extremes of a run over all of its accepted steps"}
    values = {
        "body": ("Values of a body in order; the base comes first", contract.BODY),
        "surface": ("Values of a surface in order, the lowest surface first", surface_values(spec)),
        "top": ("Values of the top in order", contract.TOP),
    }
    return {
        "name": model_name(spec),
        "abi": ABI_VERSION,
        "errors": CALL_ERRORS,
        "symbols": symbols,
        "api_functions": list(_api_functions(spec, set(symbols), header)),
        "cython_declarations": cython(header),
        "effects_text": effects_text(spec),
        "coordinates": 6 if spec.effects.uplift else 3,
        "value_lists": [(kind, text, entries) for kind, (text, entries) in values.items()],
        "quantity_lists": [(kind, meanings[kind], [(q, shape(q)) for q in fields]) for kind, fields in lists.items()],
        "status_texts": [text_in_c(status) for status in contract.STATUSES if status.compiled],
    }


def _api_functions(spec: ModelSpec, symbols: set[str], header: str) -> Iterator[tuple[str, str]]:
    """The functions of the table of a model and those of the runtime behind them, as far as it has them."""
    without = {"gradient": not spec.gradients, "port_": not spec.effects.permits_moving_ends}
    absent = tuple(prefix for prefix, true in without.items() if true)
    # always there, to refuse, and for the weights of methods
    always = ("port_new", "port_new_loaded", "port_free", "port_method")
    for name in functions(header):
        own = [symbol for symbol in (f"msfp_api_{name}", f"msfp_{name}") if symbol in symbols]
        if own and (name in always or not name.startswith(absent)):
            yield name, own[0]
        elif name.startswith("status"):
            yield name, name  # of table.c
        elif not own:
            raise AssertionError(f"no header of the runtime declares msfp_api_{name} or msfp_{name}")


def _files(folder: Traversable, suffix: str) -> Iterator[Traversable]:
    """Files of a folder of package data and of the folders in it."""
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _files(entry, suffix)
        elif entry.name.endswith(suffix):
            yield entry


_IN_C = {"pi": "MSFP_PI", "asin": "msfp_asin"}  # words of a limit that are no values


def checks_context(spec: ModelSpec) -> dict[str, Any]:
    """Variables of the template of the checks."""
    surface = surface_values(spec)
    words = _IN_C | {
        value.name: f"{kind}[{_index(kind, value)}]"
        for kind, values in (("body", contract.BODY), ("surface", surface))
        for value in values
    }
    return {
        "largest_friction_state": repr(contract.LARGEST_FRICTION_STATE),
        "longest_heating": repr(LONGEST),
        "max_rows": repr(contract.MAX_ROWS),
        "ranges": {
            "body": [_range(value, "bodies: ", _index("body", value)) for value in contract.BODY],
            "surface": [_range(value, "surfaces: ", _index("surface", value)) for value in surface],
            "top": [_range(value, "top: ", _index("top", value)) for value in contract.TOP],
            "top_mass": [_range(value, "top: ", _index("top", value)) for value in contract.TOP_MASS],
            "interface": [_range(value, "bearing: top: ", _index("top", value)) for value in contract.INTERFACE],
            "gravity": [_range(contract.GRAVITY)],
            "axial_load": [_range(contract.AXIAL_LOAD)],
            "scene": [_range(value, at=_place(value)) for value in contract.RUN],
        },
        "arrays": [(*_range(value, at=_place(value)), value.count, int(value.default)) for value in contract.ARRAYS],
        "bounds": {
            "body": list(_bounds(contract.BODY_BOUNDS, "bodies", words)),
            "surface": list(_bounds(contract.SURFACE_BOUNDS, "surfaces", words)),
        },
    }


def _index(kind: str, value: Value) -> str:
    return f"MSFP_{kind}_VALUES_{value.name}".upper()


def _place(value: Value) -> str:
    return f"offsetof(msfp_scene, {value.name})"


def _range(value: Value, of: str = "", at: str = "0") -> tuple[str, str, str, int, int, str]:
    """Place in C, least and largest number, whether 0 is permitted too, whether the base has no such value, message."""
    rule, (least, most) = value.rule, value.rule.limits
    if rule.computed:  # any that is as large as that
        least, most = (-inf if least < 0 else least), inf
    message = f"{of}{value.name.partition('[')[0]}: {rule.remedy_with_limits}"
    message += f"; 0: {value.zero}" if value.zero else ""
    return at, _number(least), _number(most), int(bool(value.zero)), int(not value.base), message


def _number(x: float) -> str:
    return repr(x).replace("inf", "INFINITY")


def _bounds(bounds: Iterable[Bound], of: str, words: Mapping[str, str]) -> Iterable[tuple[str, str]]:
    """Condition and message of each."""
    for bound in bounds:
        limit = re.sub(r"[a-z]\w*", lambda word: words[word[0]], bound.limit)
        sign = "<" if bound.open else "<="
        yield f"{words[bound.name]} {sign} {limit}", f"{of}: {bound.name}: {bound.remedy}"


def word_enums() -> list[tuple[str, str, str, str, list[tuple[str, str, str]]]]:
    """Enumerations whose names Python knows: type, prefix, meaning, count, (name, enumerator, meaning)."""
    statuses = tuple(status for status in contract.STATUSES if status.compiled)
    plain = {"ok": "MSFP_OK", "stopped": "MSFP_STOPPED"}
    return [
        (
            kind,
            prefix,
            meaning,
            last,
            [(e.name, plain.get(e.name, prefix + e.name.upper()), e.meaning) for e in entries],
        )
        for kind, prefix, meaning, last, entries in (
            ("status", "MSFP_E_", "How a run or an evaluation ended", "MSFP_STATUSES", statuses),
            ("integral", "MSFP_WORK_", "Integrals over a run [J]", "MSFP_WORKS", contract.WORKS),
            ("event_kind", "MSFP_EVENT_", "Kinds of events", "MSFP_EVENT_KINDS", contract.EVENT_KINDS),
            ("count", "MSFP_COUNT_", "Counters of a run", "MSFP_COUNTS", contract.COUNTERS),
            ("method", "MSFP_METHOD_", "Methods of integration", "MSFP_METHODS", contract.METHODS),
            ("monitor", "MSFP_MONITOR_", "Monitors of what a model leaves out", "MSFP_MONITORS", contract.MONITORS),
        )
    ]


@cache
def environment() -> Environment:
    """Templates of the package, in which an undefined name is an error."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    folder = resources.files("msfp_gen.templates")
    return Environment(
        loader=FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8")),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )


@cache
def public_header() -> str:
    """Text of `msfp.h`, the same for every model."""
    context = {
        "version": __version__,
        "words": word_enums(),
        "abi": ABI_VERSION,
        "errors": CALL_ERRORS,
        "heat": HEAT_KERNEL,
    }
    return environment().get_template("msfp.h.jinja").render(context, file="msfp.h")


_STRUCT = re.compile(r"typedef struct(?: \w+)? \{(.*?)\} (\w+);", re.DOTALL)
_OPAQUE = re.compile(r"typedef struct (\w+) \1;")
_CALLBACK = re.compile(r"typedef (\w+) \(\*(\w+)\)\((.*?)\);")
_FUNCTION = re.compile(r"(.+?)\(\*(\w+)\)\((.*)\)")
_ENTRY = re.compile(r"(\**)(\w+)((?:\[\w+\])*)")


@dataclass(frozen=True)
class Member:
    """One member of a struct.

    Attributes:
        name: name.
        type: C of its type without pointers and dimensions; of a function that of its result, pointers included.
        pointer: whether it is a pointer to data.
        dimensions: of an array, as in C.
        parameters: C of the parameters of a function; None: no function.
    """

    name: str
    type: str
    pointer: bool = False
    dimensions: tuple[str, ...] = ()
    parameters: str | None = None


@dataclass(frozen=True)
class Struct:
    """A struct of the header with its members in order."""

    name: str
    members: tuple[Member, ...]


def _without_comments(text: str) -> str:
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def _members(body: str) -> Iterator[Member]:
    for statement in (" ".join(part.split()) for part in body.split(";")):
        if not statement:
            continue
        if function := _FUNCTION.fullmatch(statement):
            yield Member(function[2], function[1].strip(), parameters=function[3])
            continue
        kind, entries = re.fullmatch(r"((?:const )?\w+) (.+)", statement).groups()  # type: ignore[union-attr]
        for entry in entries.split(", "):
            stars, name, dimensions = _ENTRY.fullmatch(entry).groups()  # type: ignore[union-attr]
            yield Member(name, kind, bool(stars), tuple(re.findall(r"\w+", dimensions)))


def structs(header: str) -> list[Struct]:
    """The structs of the text of `msfp.h`, in order."""
    return [Struct(name, tuple(_members(body))) for body, name in _STRUCT.findall(_without_comments(header))]


def functions(header: str) -> list[str]:
    """Names of the functions of the table `msfp_api`, in order."""
    (table,) = (struct for struct in structs(header) if struct.name == "msfp_api")
    return [member.name for member in table.members if member.parameters is not None]


def cython(header: str) -> list[str]:
    """Declarations for the body of a `cdef extern`; every array has a length that Cython knows as an enumerator."""
    code = _without_comments(header)
    every = structs(header)
    lengths = dict.fromkeys(n for s in every for m in s.members for n in m.dimensions if not n.isdigit())
    lines = [f"enum: {name}" for name in lengths]
    for name in _OPAQUE.findall(code):
        lines += [f"ctypedef struct {name}:", "    pass"]
    at = {match[2]: match.start() for match in _STRUCT.finditer(code)}
    callbacks = {match.start(): match for match in _CALLBACK.finditer(code)}
    for struct in every:
        for start in [start for start in callbacks if start < at[struct.name]]:
            match = callbacks.pop(start)
            lines.append(f"ctypedef {match[1]} (*{match[2]})({match[3]}) noexcept nogil")
        lines.append(f"ctypedef struct {struct.name}:")
        lines += [f"    {_cython_member(member)}" for member in struct.members]
    return lines


def _cython_member(member: Member) -> str:
    if member.parameters is not None:
        return f"{member.type} (*{member.name})({member.parameters}) noexcept nogil"
    dimensions = "".join(f"[{n}]" for n in member.dimensions)
    return f"{member.type} {'*' * member.pointer}{member.name}{dimensions}"
