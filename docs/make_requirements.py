"""Write docs/requirements.md, from each requirement to its tests: `python docs/make_requirements.py`.

Requirements are read from the sources that state them, and tests from the syntax trees of the tests. Nothing is listed
by hand but which manufactured solution contains an equation.
"""

from __future__ import annotations

import ast
import csv
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import NamedTuple, get_type_hints

import typer.main

from msfp_gen.cli import app
from msfp_gen.common.fields import Choice
from msfp_gen.common.tables import markdown_table
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Effects

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import docs_folder, parser
from support.manufactured_cases import quasistatic, smooth

ROOT = Path(__file__).resolve().parents[1]

INTRODUCTION = """# From requirements to tests

Written by `docs/make_requirements.py`; do not edit.

Each requirement with the tests that show it and the last measured figure. Requirements are read from where they are
stated: the equations that the generator cites, the values of every effect, the statuses, monitors, events and methods
of the contract, the commands, the sources of the [validation](validation.md), and the promises of the pages, which name
their tests. Tests are found by what they cite, use or compare: a test shows an equation if its name, docstring or
comments cite it, or if its file compares with the part of the reference that does. A requirement without a test, and a
test that is named and does not exist, fail `tests/docs/test_requirements.py`. At most three tests are listed; "+4" are
four more. The figures are those of [verification.md](verification.md) and of the validation.
"""
RIMS = {"2.102", *(f"3.{n}" for n in range(20, 26))}  # equations that only a case with rims contains
SHOWN = 3
Number = str


class Requirement(NamedTuple):
    """One row: what is required, all tests that show it, and the last measured figure."""

    name: str
    tests: tuple[str, ...]
    figure: str = ""


@dataclass(frozen=True)
class Module:
    """What a file of tests contains.

    Attributes:
        path: relative to the checkout.
        functions: name of each test -> its text, with decorators.
        said: the same -> its name, docstring and comments.
        rest: the text outside of them.
        pairs: (keyword, constant) of calls and dictionaries anywhere; with constant None where it is no constant.
        constants: every constant text.
        imports: names of imported modules.
    """

    path: str
    functions: dict[str, str]
    said: dict[str, str]
    rest: str
    pairs: frozenset[tuple[str, object]]
    constants: frozenset[str]
    imports: frozenset[str]


def numbers(text: str) -> set[Number]:
    """Numbers of equations cited as (3.18), or as a range (3.4)-(3.11); also those in names, as `slip_3_14`."""
    found = set()
    for first, last in re.findall(r"\((\d\.\d+)\)(?:(?:-|, | to )\((\d\.\d+)\))?", text):
        found |= {first} | ({last} if last else set())
        chapter, begin = first.split(".")
        if last.startswith(f"{chapter}."):
            found |= {f"{chapter}.{n}" for n in range(int(begin), int(last.split(".")[1]) + 1)}
    return found | {f"{a}.{b}" for a, b in re.findall(r"_(\d)_(\d+)(?=_)", text)}


@cache
def modules() -> tuple[Module, ...]:
    """All files of tests."""
    return tuple(module(path) for path in sorted((ROOT / "tests").rglob("test_*.py")))


def module(path: Path) -> Module:
    text = path.read_text(encoding="utf-8")
    tree, lines = ast.parse(text), text.splitlines()
    functions, said, taken = {}, {}, set()
    for node in tree.body:
        named = isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
        decorated = isinstance(node, ast.FunctionDef) and any("holds" in ast.unparse(d) for d in node.decorator_list)
        if isinstance(node, ast.FunctionDef) and (named or decorated):
            begin = min([node.lineno, *(each.lineno for each in node.decorator_list)]) - 1
            functions[node.name] = "\n".join(lines[begin : node.end_lineno])
            comments = re.findall(r"#.*", functions[node.name])
            said[node.name] = "\n".join([f"{node.name}_", ast.get_docstring(node) or "", *comments])
            taken |= set(range(begin, node.end_lineno or begin))
    pairs: set[tuple[str, object]] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg:
            pairs.add((node.arg, node.value.value if isinstance(node.value, ast.Constant) else None))
        elif isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                if isinstance(key, ast.Constant) and isinstance(key.value, str):
                    pairs.add((key.value, value.value if isinstance(value, ast.Constant) else None))
    constants = {n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, str)}
    imports = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            imports |= {f"{node.module}", *(f"{node.module}.{name.name}" for name in node.names)}
        elif isinstance(node, ast.Import):
            imports |= {name.name for name in node.names}
    rest = "\n".join(line for i, line in enumerate(lines) if i not in taken)
    return Module(
        path.relative_to(ROOT).as_posix(),
        functions,
        said,
        rest,
        frozenset(pairs),
        frozenset(constants),
        frozenset(imports),
    )


@cache
def verification() -> dict[str, str]:
    """Case of docs/verification.md -> its orders of the angles."""
    rows = re.findall(r"^\| (.+?) \| angles \| (.+?) \| (.+?) \| (.+?) \|", page_of("verification"), re.MULTILINE)
    return {name: "orders " + ", ".join(order for order in found if order != "–") for name, *found in rows}


def page_of(name: str) -> str:
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


# ---- equations -------------------------------------------------------------------------------------------------


@cache
def reference() -> dict[str, set[Number]]:
    """Module of the reference in plain vectors -> equations that it cites."""
    return {path.stem: numbers(path.read_text("utf-8")) for path in sorted((ROOT / "tests" / "reference").glob("*.py"))}


def equations() -> Iterator[Requirement]:
    """Every equation that the generator cites. A test that compares with the reference shows what its module cites."""
    cited = set().union(*(numbers(path.read_text("utf-8")) for path in (ROOT / "generator").glob("*.py")))
    for number in sorted(cited, key=lambda each: [int(part) for part in each.split(".")]):
        parts = {f"reference.{name}" for name, found in reference().items() if number in found}
        direct = [
            f"{each.path}::{name}" for each in modules() for name, text in each.said.items() if number in numbers(text)
        ]
        through = [each.path for each in modules() if each.imports & parts]
        case = "rims" if number in RIMS else "spatial"
        yield Requirement(f"({number})", (*direct, *through), f"{verification()[case]} (`{case}`)")


# ---- effects ---------------------------------------------------------------------------------------------------


def effects() -> Iterator[Requirement]:
    """Every value of every effect: manufactured solutions with it, and tests that select it by name."""
    hints, cases = get_type_hints(Effects, include_extras=True), {**smooth(), **quasistatic()}
    for field in fields(Effects):
        choices = [part for part in getattr(hints[field.name], "__metadata__", ()) if isinstance(part, Choice)]
        for value in choices[0].words if choices else ():
            using = [name for name, case in cases.items() if getattr(case.effects, field.name) == value]
            selecting = [each.path for each in modules() if selects(each, field.name, value)]
            tests = [*(f"tests/physics/test_manufactured.py::{name}" for name in using), *selecting]
            figure = f"{verification()[using[0]]} (`{using[0]}`)" if using and using[0] in verification() else ""
            word = str(value).lower() if isinstance(value, bool) else value
            yield Requirement(f"`{field.name}` = `{word}`", tuple(tests), figure)


def selects(each: Module, name: str, value: object) -> bool:
    """Whether tests give the keyword this value, or a variable while the value is among their constants."""
    given = any(key == name and type(found) is type(value) and found == value for key, found in each.pairs)
    return given or ((name, None) in each.pairs and isinstance(value, str) and value in each.constants)


# ---- words of the contract, commands ---------------------------------------------------------------------------


def words() -> Iterator[Requirement]:
    """Statuses, monitors, events and methods: tests that compare with, give or expect the word."""
    groups = (
        ("status", contract.STATUSES, "status"),
        ("monitor", contract.MONITORS, "note|trip|monitor"),
        ("event", contract.EVENT_KINDS, "event|kind"),
        ("method", contract.METHODS, "method"),
    )
    for group, entries, beside in groups:
        for entry in entries:
            tests = [
                f"{each.path}::{name}"
                for each in modules()
                for name, text in each.functions.items()
                if re.search(rf"[\"']{entry.name}[\"']", text) and re.search(beside, text)
            ]
            around = [
                each.path
                for each in modules()
                if entry.name in each.constants and re.search(beside, each.rest) and f'"{entry.name}"' in each.rest
            ]
            yield Requirement(f"{group} `{entry.name}`", (*tests, *around))


def commands() -> Iterator[Requirement]:
    """Every command: tests that call it."""
    for name in sorted(typer.main.get_command(app).commands):  # type: ignore[attr-defined]
        calls = rf"(main\(|run\(|\[)[^\n]*[\"']{name}[\"']"
        tests = [
            f"{each.path}::{function}"
            for each in modules()
            for function, text in each.functions.items()
            if re.search(calls, text)
        ]
        yield Requirement(f"`msfp-gen {name}`", tuple(tests))


# ---- sources of the validation, promises of pages --------------------------------------------------------------


def sources() -> Iterator[Requirement]:
    """Every source of the validation: its comparisons."""
    table = ROOT / "benchmarks" / "results" / "comparisons.csv"
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    for source in dict.fromkeys(row["source"] for row in rows):
        own = [row for row in rows if row["source"] == source]
        inside = sum(abs(float(row["difference"])) <= float(row["tolerance"]) for row in own)
        kind = own[0]["kind"]
        limit = f"{float(own[0]['tolerance']):.0%}"
        test = "tests/docs/test_validation_page.py::test_every_comparison_has_source_and_tolerance"
        yield Requirement(f"{source} ({kind})", (test,), f"{inside} of {len(own)} within {limit}")


@cache
def homes() -> dict[str, tuple[str, ...]]:
    """Name of a test -> files that have it."""
    found: dict[str, list[str]] = {}
    for each in modules():
        for name in {*each.functions, *re.findall(r"\b(test_\w+)\b(?= = |: )", each.rest)}:
            found.setdefault(name, []).append(each.path)
    return {name: tuple(files) for name, files in found.items()}


def promises() -> Iterator[Requirement]:
    """Every section of a page that names tests. A page without: tests that read it or have its name, and scripts."""
    for path in sorted((ROOT / "docs").glob("*.md")):
        if path.name == "requirements.md":
            continue
        sections = re.split(r"^## ", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        named = False
        for section in sections[1:]:
            title, _, body = section.partition("\n")
            names = list(dict.fromkeys(re.findall(r"\b(test_\w+)(?:\.py)?\b", body)))
            tests = [test for name in names for test in found(name)]
            if names:
                named = True
                yield Requirement(f"[{path.stem}]({path.name}), {title.strip()}", tuple(tests))
        if not named:
            stem = re.compile(rf"\b{path.stem}\.md\b|docs/{path.stem}\b")
            reading = [
                each.path
                for each in modules()
                if stem.search(whole(each)) or Path(each.path).stem.removeprefix("test_").startswith(path.stem)
            ]
            scripts = re.findall(r"benchmarks/\w+\.py", path.read_text(encoding="utf-8"))
            yield Requirement(f"[{path.stem}]({path.name})", (*reading, *scripts))


def whole(each: Module) -> str:
    return "\n".join([each.rest, *each.functions.values()])


def found(name: str) -> list[str]:
    """A named test with its files, or a file of tests; what does not exist is named as such."""
    if name in homes():
        return [f"{file}::{name}" for file in homes()[name]]
    files = [each.path for each in modules() if Path(each.path).stem == name]
    begins = [f"{file}::{test}" for test, places in homes().items() if test.startswith(name) for file in places]
    return files or begins or [f"MISSING {name}"]


# ---- the page --------------------------------------------------------------------------------------------------

SECTIONS = (
    ("Equations of PEER 2017/07 in the generator", "equation", equations),
    ("Effects", "effect", effects),
    ("Words of the contract", "word", words),
    ("Commands", "command", commands),
    ("Sources of the validation", "source", sources),
    ("Promises of pages", "section", promises),
)


def cell(tests: Iterable[str]) -> str:
    kept = list(dict.fromkeys(tests))
    more = f", +{len(kept) - SHOWN}" if len(kept) > SHOWN else ""
    return ", ".join(f"`{test}`" for test in kept[:SHOWN]) + more


@cache
def requirements() -> dict[str, tuple[Requirement, ...]]:
    """All requirements by section."""
    return {title: tuple(make()) for title, _, make in SECTIONS}


def page() -> str:
    """Text of docs/requirements.md."""
    parts = [INTRODUCTION]
    total = sum(map(len, requirements().values()))
    parts.append(f"{total} requirements.\n")
    for title, head, _ in SECTIONS:
        rows = requirements()[title]
        measured = any(row.figure for row in rows)
        names = (head, "tests", *(["last measured"] if measured else []))
        cells = [(row.name, cell(row.tests), *([row.figure or "–"] if measured else [])) for row in rows]
        parts.append(f"## {title}\n\n{markdown_table(names, cells)}\n")
    return "\n".join(parts)


def main() -> None:
    (docs_folder() / "requirements.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    parser(__doc__).parse_args()
    main()
