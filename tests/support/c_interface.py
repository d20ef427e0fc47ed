"""The C interface through ctypes, its structs and functions read from the text of msfp.h itself.

A field that is added to the header is therefore known here, and to the tests that try every field.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from msfp_gen.generator.interface import public_header

Array = np.ndarray
_PLAIN: dict[str, Any] = {
    "int": ctypes.c_int,
    "long": ctypes.c_long,
    "double": ctypes.c_double,
    "size_t": ctypes.c_size_t,
    "int64_t": ctypes.c_int64,
    "void": None,
}


class Interface:
    """The table of functions of a compiled model: `table.run_new(...)`; integers as attributes, as `table.row_size`.

    enums: enumerator -> number. sizes: those and the numbers of `#define`. structs: name -> ctypes.Structure.
    """

    def __init__(self, library: str, name: str) -> None:
        self.enums, self.sizes, self.structs, members = header()
        self._library = ctypes.CDLL(library)
        entry = getattr(self._library, name)
        entry.restype = ctypes.POINTER(self.structs["msfp_api"])
        self._table = entry().contents
        self._functions = {key: kind for key, kind in members.items() if kind is not None}

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._table, name)
        return self._functions[name](value) if name in self._functions else value

    def has(self, function: str) -> bool:
        """Whether the table has a function, and not NULL."""
        return bool(getattr(self._table, function))

    def new(self, struct: str) -> Any:
        """A struct of zeros."""
        return self.structs[struct]()

    def word(self, status: int) -> str:
        """Name of a status."""
        text: bytes = ctypes.string_at(self.status_name(status))
        return text.decode()


@cache
def header() -> tuple[dict[str, int], dict[str, int], dict[str, Any], dict[str, Any]]:
    """Enumerators, sizes, structs, and members of the table: name -> type of a function, None for other members."""
    text = re.sub(r"/\*.*?\*/", "", public_header(), flags=re.DOTALL)
    enums = dict(_enumerators(text))
    sizes = enums | {name: int(size) for name, size in re.findall(r"#define (MSFP_\w+) (\d+)", text)}
    structs: dict[str, Any] = {}
    functions: dict[str, Any] = {}
    for body, name in re.findall(r"typedef struct(?: \w+)? \{(.*?)\n\} (\w+);", text, flags=re.DOTALL):
        fields = []
        for line in (" ".join(part.split()) for part in body.split(";")):
            for member, kind, function in _members(line, structs, sizes):
                fields.append((member, kind))
                functions[member] = function
        structs[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
    return enums, sizes, structs, functions


def _enumerators(text: str) -> Iterator[tuple[str, int]]:
    for body in re.findall(r"enum \w+ \{(.*?)\}", text, flags=re.DOTALL):
        value = -1
        for entry in filter(None, (part.strip() for part in body.split(","))):
            name, _, given = (part.strip() for part in entry.partition("="))
            value = int(given) if given else value + 1
            yield name, value


def _members(line: str, structs: dict[str, Any], sizes: dict[str, int]) -> Iterator[tuple[str, Any, Any]]:
    """Name, type and function of the members that one declaration declares."""
    if not line:
        return
    if found := re.match(r"(.*?)\(\*(\w+)\)\((.*)\)$", line):
        result, name, arguments = found.groups()
        kinds = [_kind(part, structs) for part in arguments.split(",") if part.strip() != "void"]
        yield name, ctypes.c_void_p, ctypes.CFUNCTYPE(_kind(result, structs), *kinds)
        return
    word, rest = line.removeprefix("const ").split(" ", 1)
    for declared in rest.split(","):
        plain = declared.replace("*", " ").replace("const ", " ").split("[")[0].strip()
        kind = ctypes.c_void_p if "*" in declared else _kind(word, structs)
        for length in reversed(re.findall(r"\[(\w+)\]", declared)):
            kind *= int(length) if length.isdigit() else sizes[length]
        yield plain, kind, None


def _kind(declared: str, structs: dict[str, Any]) -> Any:
    if "*" in declared or "callback" in declared:
        return ctypes.c_void_p
    word = declared.removeprefix("const ").split()[0]
    return _PLAIN[word] if word in _PLAIN else structs[word]


def pointer(values: Array | None) -> int | None:
    """Address of the numbers of an array, which must live as long as it is used."""
    return None if values is None else values.ctypes.data
