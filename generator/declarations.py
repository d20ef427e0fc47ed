"""The types and functions of `msfp.h` in other languages: the header is their only description.

The text of the header is read, not a table beside it: what a program in C includes is what Cython and Fortran are told.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

_STRUCT = re.compile(r"typedef struct(?: \w+)? \{(.*?)\} (\w+);", re.DOTALL)
_OPAQUE = re.compile(r"typedef struct (\w+) \1;")
_CALLBACK = re.compile(r"typedef (\w+) \(\*(\w+)\)\((.*?)\);")
_CONSTANT = re.compile(r"#define (\w+) (\d+)")
_FUNCTION = re.compile(r"(.+?)\(\*(\w+)\)\((.*)\)")
_ENTRY = re.compile(r"(\**)(\w+)((?:\[\w+\])*)")
_FORTRAN = {"int": "integer(c_int)", "double": "real(c_double)", "size_t": "integer(c_size_t)"}
_ZEROS = {"integer(c_int)": "0", "real(c_double)": "0.0_c_double", "integer(c_size_t)": "0"}


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


def fortran(header: str) -> list[str]:
    """Derived types that are interoperable with the structs. What is given to C, with pointers, is null and zero."""
    known = dict(_CONSTANT.findall(header))
    lines: list[str] = []
    for struct in structs(header):
        lines += ["", f"type, bind(c) :: {struct.name}"]
        has_defaults = any(member.pointer for member in struct.members)
        lines += [f"   {_fortran_member(member, known, has_defaults)}" for member in struct.members]
        lines.append("end type")
    return lines


def _fortran_member(member: Member, lengths: dict[str, str], has_defaults: bool) -> str:
    if member.parameters is not None:
        return f"type(c_funptr) :: {member.name} = c_null_funptr"
    if member.pointer:
        return f"type(c_ptr) :: {member.name} = c_null_ptr"
    kind = _FORTRAN.get(member.type)
    if kind is None:
        return f"type({member.type}) :: {member.name}"
    sizes = ", ".join(lengths.get(n, n) for n in reversed(member.dimensions))
    default = f" = {_ZEROS[kind]}" if has_defaults else ""
    return f"{kind} :: {member.name}{f'({sizes})' if sizes else ''}{default}"
