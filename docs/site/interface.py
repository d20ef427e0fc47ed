"""Pages of the Python interface: short types with their units, and every field of a class listed once."""

from __future__ import annotations

import inspect
import re
from typing import Any

from docutils import nodes
from docutils.nodes import Element
from sphinx import addnodes
from sphinx.application import Sphinx

import msfp_gen

ALIASES = {"Array": "ndarray", "ArrayLike": "array_like"}  # shown by these names, not by what they stand for
_RULE = re.compile(r"~?(?:typing\.|types\.)?Annotated\[(.*), [~\w.]+\((.*)\)\]", re.DOTALL)
_UNIT = re.compile(r"unit=(.*?), above=")
_NAMES = re.compile(r"(ivar|vartype) ([^\s,]+(?:, [^\s,]+)+)")
_SHORTER = (
    (r"[~.\w]*_Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]", "array_like"),  # in a union: no alias there
    (r"~?(?:numpy\.)?ndarray\[tuple\[\S*Any, \.\.\.\], \S*float64\]\]", "ndarray"),
    (r"\bArray\b", "ndarray"),  # as napoleon has it
    (r"TypeAliasForwardRef\('(\w+)'\)", r"\1"),
    (r"dataclasses\.InitVar\[(.*)\]", r"\1"),
    (r"(?<![~.\w])(?:msfp_gen|collections|typing|numpy)\.", r"~\g<0>"),
)


def type_text(annotation: str) -> str:
    """The text of a type for a reader: the unit of a quantity or the words of a choice, and no other rules."""
    if found := _RULE.fullmatch(annotation):
        annotation, rule = found.groups()
        unit = _UNIT.search(rule)
        words = re.findall(r"'([\w-]+)': " if "{" in rule else r"'([\w-]+)'", rule.partition("words=")[2])
        stem, none, _ = annotation.partition(" | None")
        annotation = (
            f"{stem} [{unit[1]}]{none}" if unit and unit[1] else f"{annotation}: {', '.join(words)}".rstrip(": ")
        )
    for pattern, text in _SHORTER:
        annotation = re.sub(pattern, text, annotation)
    return annotation


def keep_colons(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """After napoleon, which takes the summary of a property for its type where it has a colon."""
    if what == "property":
        lines[:] = [*(inspect.getdoc(obj) or "").splitlines(), ""]


def shorten(app: Sphinx, domain: str, kind: str, content: Element) -> None:
    """Before types are merged: shorter ones, a field for each name of `a, b: text`, no signatures by type."""
    signatures = [node for node in content.parent if isinstance(node, addnodes.desc_signature)]
    if hasattr(getattr(msfp_gen, signatures[0].get("fullname", ""), None), "registry"):  # functools.singledispatch
        for node in signatures[1:]:
            content.parent.remove(node)
    for node in signatures[0].findall(addnodes.desc_annotation):
        if "TypeAliasForwardRef" in node.astext():  # an alias inside a generic type is a call with its name
            node[:] = [
                nodes.Text(part.astext().strip("'")) if part.astext().startswith("'") else part
                for part in node
                if part.astext() not in "()" and not part.astext().startswith("TypeAliasForwardRef")
            ]
    hints: dict[str, str]
    for hints in app.env.current_document.autodoc_annotations.values():
        for name, annotation in list(hints.items()):
            hints[name] = type_text(annotation)
            if name == "return" and annotation in ("None", "~typing.Any"):
                del hints[name]
    for fields in fields_of(content):
        for field in list(fields):
            if found := _NAMES.fullmatch(field[0].astext()):
                place = fields.index(field)
                fields[place : place + 1] = [
                    nodes.field("", nodes.field_name("", f"{found[1]} {name}"), field[1].deepcopy())
                    for name in found[2].split(", ")
                ]
            elif field[0].astext().startswith("vartype "):
                field[1] = nodes.field_body("", nodes.paragraph("", type_text(field[1].astext())))


def list_once(app: Sphinx, domain: str, kind: str, content: Element) -> None:
    """After types are merged: a class that describes its fields does not list them again as parameters."""
    for fields in fields_of(content):
        if any(field[0].astext().startswith("ivar ") for field in fields):
            for field in list(fields):
                if field[0].astext().split()[0] in ("param", "type"):
                    fields.remove(field)


def fields_of(content: Element) -> list[Any]:
    """The lists of fields of an object, without its members."""
    return [node for node in content if isinstance(node, nodes.field_list)]


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", keep_colons, priority=600)
    app.connect("object-description-transform", shorten, priority=400)
    app.connect("object-description-transform", list_once, priority=600)
