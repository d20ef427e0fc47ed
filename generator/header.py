"""The templates, and the text of the public header, which is the same for every model."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

from msfp_gen.specification import contract
from msfp_gen.specification.heat_kernel import HEAT_KERNEL
from msfp_gen.version import __version__

from .interface import ABI_VERSION, CALL_ERRORS

if TYPE_CHECKING:
    from jinja2 import Environment


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
