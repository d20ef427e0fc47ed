"""Texts from the templates in `assets/`, whose `[[ ]]` and `[% %]` leave the braces of C and of Make alone."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.resources import files
from typing import Any


def render(name: str, content: dict[str, Any], package: str = __package__) -> str:
    """Text of the template `assets/<name>.jinja` of a package; a name that `content` lacks is an error."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
        block_start_string="[%", block_end_string="%]", variable_start_string="[[", variable_end_string="]]",
        comment_start_string="[#", comment_end_string="#]",
    )  # fmt: skip
    environment.filters["c"] = _number
    environment.filters["fortran"] = _fortran_number
    environment.filters["fortran_list"] = _fortran_list
    text = files(package).joinpath("assets", f"{name}.jinja").read_text(encoding="utf-8")
    return environment.from_string(text).render(content)


def _number(value: float) -> str:
    """A number as C and Fortran read it: with a point or an exponent."""
    text = repr(float(value))
    return text.replace("e+0", "e").replace("e-0", "e-")


def _fortran_number(value: float) -> str:
    """A number of double precision."""
    text = _number(value)
    return text.replace("e", "d") if "e" in text else f"{text}d0"


def _fortran_list(values: Iterable[float]) -> str:
    """An array constructor, eight numbers on a line."""
    texts = [_fortran_number(value) for value in values]
    lines = [", ".join(texts[i : i + 8]) for i in range(0, len(texts), 8)]
    return "[real(c_double) :: " + ", &\n         ".join(lines) + "]"
