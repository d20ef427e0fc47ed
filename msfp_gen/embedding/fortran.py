"""Types and interfaces of `msfp.h` in Fortran, emitted from the text of the header."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.generator.interface import Member

_PARAMETER = re.compile(r"(const )?(\w+) ?(\**)(\w+)")
_TYPES = {
    "int": "integer(c_int)",
    "long": "integer(c_long)",
    "int64_t": "integer(c_int64_t)",
    "double": "real(c_double)",
    "size_t": "integer(c_size_t)",
}
_LISTS = {"double", "int64_t", "msfp_variable", "msfp_trip"}  # types whose pointers are arrays
_CONSTANT = re.compile(r"#define (\w+) (\d+)")
_ZEROS = {"integer(c_int)": "0", "real(c_double)": "0.0_c_double", "integer(c_size_t)": "0"}
_ON_A_LINE = 6  # parameters: a line of Fortran may have 132 characters


def types(header: str) -> list[str]:
    """Derived types that are interoperable with the structs. What is given to C, with pointers, is null and zero."""
    from msfp_gen.generator.interface import structs  # it imports SymPy

    known = dict(_CONSTANT.findall(header))
    lines: list[str] = []
    for struct in structs(header):
        lines += ["", f"type, bind(c) :: {struct.name}"]
        has_defaults = any(member.pointer for member in struct.members)
        lines += [f"   {_member(member, known, has_defaults)}" for member in struct.members]
        lines.append("end type")
    return lines


def _member(member: Member, lengths: dict[str, str], has_defaults: bool) -> str:
    if member.parameters is not None:
        return f"type(c_funptr) :: {member.name} = c_null_funptr"
    if member.pointer:
        return f"type(c_ptr) :: {member.name} = c_null_ptr"
    kind = _TYPES.get(member.type)
    if kind is None:
        return f"type({member.type}) :: {member.name}"
    sizes = ", ".join(lengths.get(n, n) for n in reversed(member.dimensions))
    default = f" = {_ZEROS[kind]}" if has_defaults else ""
    return f"{kind} :: {member.name}{f'({sizes})' if sizes else ''}{default}"


def interfaces(header: str) -> list[str]:
    """Lines of the abstract interfaces `f_<name>` of the functions of the table `msfp_api`."""
    from msfp_gen.generator.interface import structs  # it imports SymPy

    every = structs(header)
    (table,) = (struct for struct in every if struct.name == "msfp_api")
    known = {struct.name for struct in every}
    lines: list[str] = []
    for member in table.members:
        if member.parameters is None:
            continue
        parameters = _PARAMETER.findall(member.parameters)
        names = [name for *_, name in parameters]
        listed = ", &\n   ".join(", ".join(names[i : i + _ON_A_LINE]) for i in range(0, len(names), _ON_A_LINE))
        kind, result = ("subroutine", "") if member.type == "void" else ("function", " result(answer)")
        lines += f"{kind} f_{member.name}({listed}) bind(c){result}".splitlines()
        lines.append("   import")
        lines += [f"   {_declaration(parameter, known)}" for parameter in parameters]
        if result:
            lines.append(f"   {_TYPES.get(member.type, 'type(c_ptr)')} :: answer")
        lines.append(f"end {kind}")
    return lines


def _declaration(parameter: tuple[str, str, str, str], known: set[str]) -> str:
    """Declaration of one parameter; `known`: the structs whose members Fortran sees."""
    const, kind, stars, name = parameter
    if kind.endswith("_callback"):
        return f"type(c_funptr), value :: {name}"
    if stars == "**":
        return f"type(c_ptr), intent(out) :: {name}"
    if kind not in _TYPES and kind not in known:
        return f"type(c_ptr), value :: {name}"
    of = _TYPES.get(kind) or f"type({kind})"
    if not stars:
        return f"{of}, value :: {name}"
    return f"{of}, optional, intent({'in' if const else 'inout'}) :: {name}{'(*)' if kind in _LISTS else ''}"
