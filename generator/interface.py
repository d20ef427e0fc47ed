"""What the public C interface states about a model: its name, its external names, its lists of numbers, its texts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import resources
from typing import TYPE_CHECKING, Any

from msfp_gen.specification import contract, rows
from msfp_gen.specification.values import Value

from . import declarations

if TYPE_CHECKING:
    from importlib.abc import Traversable  # in Python 3.14 importlib.resources.abc alone

    from msfp_gen.specification.layout import ModelSpec

ABI_VERSION = 2
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
    known = {value.name: value for value in (*contract.SURFACE, *contract.SURFACE_UPLIFT)}
    return [(known | contract.NUMBERS)[name] for name in contract.surface_values(spec.effects)]


def effects_text(spec: ModelSpec) -> str:
    """The effects of a model in one line."""
    e = spec.effects
    law = f" (mu = {e.law.text})" if e.law is not None else ""
    switches = {"rims": e.rims, "uplift": e.uplift, "top_rotation": e.top_rotation}
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
    """What the templates of the public interface need; shape: of a quantity, in numbers; header: text of `msfp.h`."""
    symbols = runtime_symbols()
    lists = {"row": rows.row(spec.effects), "extremes": rows.extremes(spec.effects)}
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
        "cython_declarations": declarations.cython(header),
        "effects_text": effects_text(spec),
        "coordinates": 6 if spec.effects.uplift else 3,
        "value_lists": [(kind, text, entries) for kind, (text, entries) in values.items()],
        "quantity_lists": [(kind, meanings[kind], [(q, shape(q)) for q in fields]) for kind, fields in lists.items()],
        "status_texts": [text_in_c(status) for status in contract.STATUSES if status.compiled],
    }


def _api_functions(spec: ModelSpec, symbols: set[str], header: str) -> Iterator[tuple[str, str]]:
    """The functions of the table of a model and those of the runtime behind them; of gradients where it has them."""
    for name in declarations.functions(header):
        own = [symbol for symbol in (f"msfp_api_{name}", f"msfp_{name}") if symbol in symbols]
        if own and (spec.gradients or not name.startswith("gradient")):
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
