"""Count the lines of Python and C that tests of the physics run, and write docs/coverage.md (`make coverage`).

Python is counted by coverage.py, C by gcov: models are compiled by a gcc that is told to count (`--coverage -O0`), into a
cache of their own in `build/coverage`. The tests run in processes side by side, and not on workers of pytest-xdist: these
end by `os._exit`, before libraries write their counts. A row of physics below 95 % is an error, as is a test that fails.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from quick import QUICK, docs_folder, installed, parser, pick

from msfp_gen.common.cores import usable_cores
from msfp_gen.common.output import replacing

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "build" / "coverage"
PROCESSES = 2
LEAST = 95.0  # [%] of the lines of each row of physics

UNIT, RUNS = "tests/unit", "tests/physics"
# Parts of the tests, each a process of pytest, two at a time and the longest first. They are a choice, since the models of
# all tests would take hours with counting. Not tests/unit/runtime/test_sanitizers.py: with sanitizers gcc makes code of
# declarations too, which then count as lines.
TESTS = pick(
    (
        (f"{RUNS}/test_friction_laws.py", f"{RUNS}/test_hysteresis.py"),
        (f"{UNIT}/simulation",),
        (f"{UNIT}/buildings",),
        (f"{RUNS}/test_gradients.py", f"{RUNS}/test_gradients_free.py"),
        (f"{UNIT}/embedding",),
        (f"{RUNS}/test_uplift.py", f"{RUNS}/test_building_uplift.py", f"{RUNS}/test_buildings.py"),
        (f"{UNIT}/generator", f"{UNIT}/specification"),
        (f"{UNIT}/results", f"{UNIT}/model"),
        (f"{UNIT}/motions", f"{UNIT}/scene"),
        (f"{UNIT}/runtime/test_esdirk.py", f"{UNIT}/runtime/test_math.py"),
        (f"{RUNS}/test_loads.py",),
        (f"{UNIT}/studies/test_estimate.py",),
        (f"{RUNS}/test_quasistatic.py", f"{RUNS}/test_two_port.py", f"{RUNS}/test_vertical_compliance.py"),
    ),
    ((f"{UNIT}/model",), (f"{UNIT}/specification/test_layout.py",)),
)

# It asks that an interrupted run ends within 5 s, which one that writes counts does not on a busy machine.
LEFT_OUT = f"{UNIT}/simulation/test_failures.py::test_interrupt_keeps_what_was_computed"

# Physics: what decides the numbers of a run, from the equations to what is read off its rows. Row -> folders, files.
PYTHON = {
    "generator": ("generator",),
    **{
        name: (f"msfp_gen/{name}",)
        for name in (
            "specification",
            "motions",
            "scene",
            "model",
            "simulation",
            "results",
            "buildings",
        )
    },
    "embedding, two ports": ("msfp_gen/embedding/two_port.py", "msfp_gen/embedding/server.py"),
}
C = {
    **{
        f"runtime/{name}": (f"msfp_gen/runtime/{name}",)
        for name in ("equations", "steppers", "run", "gradients", "port", "api")
    },
    "runtime, headers beside": ("msfp_gen/runtime",),
    "buildings/compiled": ("msfp_gen/buildings/compiled",),
    "studies/estimation/compiled": ("msfp_gen/studies/estimation/compiled",),
}
# The functions of the standard for units (FMU).
INTERFACE = {"embedding/assets/fmi": ("msfp_gen/embedding/assets/fmi",)}
EMITTED = frozenset(path.name.removesuffix(".jinja") for path in (ROOT / "templates").glob("*.[ch].jinja"))

# A compiler that counts lines. What gcov needs later, notes and sources, is kept in the folder into which libgcov writes
# the counts, since models are built in folders that are renamed and units (FMU) in some that are deleted.
COMPILER = """#!/bin/sh
output=
for word; do
    [ "$last" = -o ] && output=$word
    last=$word
done
[ -n "$output" ] || exec gcc "$@"
gcc "$@" --coverage -fprofile-update=atomic -O0 || exit
from=$(cd "$(dirname "$output")" && pwd -P)
name=$(basename "$output" .o)
for note in "$from/$name.gcno" "$from/$name"-*.gcno; do
    [ -f "$note" ] || continue
    mkdir -p {counts}"$from"
    cp "$note" {counts}"$from"
    for word; do
        case $word in *.c) cp "$word" {counts}"$from" ;; esac
    done
done
exit 0
"""
SETTINGS = """[run]
source =
    {root}/msfp_gen
    {root}/generator
data_file = {folder}/python/counts
parallel = true
concurrency = thread,multiprocessing
patch = subprocess,_exit
disable_warnings = no-data-collected,module-not-imported,module-not-measured,couldnt-parse
"""


class Lines(NamedTuple):
    """Lines of one file that a compiler makes code of: number -> whether it ran, and the function that it is in."""

    ran: dict[int, bool]
    function: dict[int, str]

    def add(self, number: int, ran: bool, function: str) -> None:
        """Count a line; it ran if it ran in any model or instance."""
        self.ran[number] = self.ran.get(number, False) or ran
        self.function.setdefault(number, function)


def empty() -> Lines:
    return Lines({}, {})


# ---- the run


def begin(folder: Path, resume: bool) -> None:
    """An empty folder, or that of a run that was stopped. SystemExit where sources have changed since."""
    total = hashlib.sha256()
    for top in ("msfp_gen", "generator", "templates"):
        for path in sorted((ROOT / top).rglob("*.*")):
            if path.is_file() and "__pycache__" not in path.parts:
                total.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    mark = folder / "sources.sha256"
    if resume:
        if not mark.is_file() or mark.read_text(encoding="utf-8") != total.hexdigest():
            raise SystemExit("--resume: there is no run of these sources to go on with; leave it out")
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    mark.write_text(total.hexdigest(), encoding="utf-8")


def compiler(folder: Path) -> Path:
    """Write a compiler whose programs count lines into `folder / "counts"`, which GCOV_PREFIX has to name."""
    path = folder / "cc"
    path.write_text(COMPILER.replace("{counts}", shlex.quote(str(folder / "counts"))), encoding="utf-8")
    path.chmod(0o755)
    return path


def run_tests(folder: Path) -> int:
    """Run all parts of the tests that have not passed, and return how many tests passed. SystemExit where one fails."""
    settings = folder / "settings"
    (folder / "python").mkdir(exist_ok=True)
    settings.write_text(SETTINGS.format(root=ROOT, folder=folder), encoding="utf-8")
    environment = {
        **os.environ,
        "CC": shlex.quote(str(compiler(folder))),
        "GCOV_PREFIX": str(folder / "counts"),
        "MSFP_GEN_CACHE": str(folder / "models"),
        "PYTHONPATH": str(ROOT),
    }
    environment.pop("MSFP_GEN_CFLAGS", None)
    pytest = (sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest", "-q", "-m", "not slow")

    def passed(part: tuple[str, ...]) -> int | None:
        """Run a part, or of one that has run what failed; how many tests passed, None where one failed."""
        log = folder / f"{re.sub(r'[/.]', '-', part[0].removeprefix('tests/'))}.log"
        before = log.read_text(encoding="utf-8") if log.is_file() else ""
        if done := re.match(r"(\d+) passed", before.rpartition("\n")[2]):
            return int(done[1])
        failed = re.findall(r"^(?:FAILED|ERROR) (tests/.*?)(?: - .*)?$", before, re.MULTILINE)
        counted = re.search(r"(\d+) passed", before.rpartition("\n")[2]) if failed else None
        own = (
            "-p",
            "no:cacheprovider",
            f"--basetemp={log.with_suffix('.files')}",
            "--durations=20",
            f"--deselect={LEFT_OUT}",
        )
        begun = time.monotonic()
        command = (*pytest, *own, *(failed if counted else part))
        run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
        last = run.stdout.strip().rpartition("\n")[2]
        found = re.match(r"(\d+) passed", last)
        if found and counted:
            last = f"{int(found[1]) + int(counted[1])} passed, of these at the second attempt {found[1]}"
        log.write_text(f"{run.stderr}{run.stdout.strip()}\n{last}", encoding="utf-8")
        print(f"{time.monotonic() - begun:5.0f} s {log.relative_to(ROOT)}: {last}", flush=True)
        return int(last.split()[0]) if found else None

    with ThreadPoolExecutor(PROCESSES) as pool:
        counts = list(pool.map(passed, TESTS))
    if None in counts:
        raise SystemExit(f"tests failed: see the logs in {folder}; --resume runs them again")
    return sum(count for count in counts if count)


# ---- Python


def of_python(folder: Path) -> dict[str, Lines]:
    """Lines of each module, by its path in the checkout, from what coverage.py counted in all processes."""
    tool = (sys.executable, "-m", "coverage")
    options = f"--rcfile={folder / 'settings'}"
    if any((folder / "python").glob("counts.*")):  # of the processes that ended since the last time
        subprocess.run([*tool, "combine", "-q", "--append", options], cwd=ROOT, check=True)
    report = folder / "python.json"
    subprocess.run([*tool, "json", "-q", options, "-o", str(report)], cwd=ROOT, check=True)
    found: dict[str, Lines] = {}
    for name, counted in json.loads(report.read_text(encoding="utf-8"))["files"].items():
        lines = found.setdefault((ROOT / name).resolve().relative_to(ROOT).as_posix(), empty())
        for function, region in counted["functions"].items():
            for number in region["executed_lines"]:
                lines.add(number, True, function)
            for number in region["missing_lines"]:
                lines.add(number, False, function)
    return found


# ---- C


def read_c(counts: Path, known: Mapping[str, Path]) -> tuple[dict[str, Lines], list[Lines]]:
    """Lines of hand-written C by path in the checkout, and of the emitted C of each model, from what gcov reads.

    known: path in the checkout -> file. A compiled file is one of them if its text is the same; a header, by its name.
    """
    texts = {path.read_bytes(): name for name, path in known.items() if path.suffix == ".c"}
    headers = {path.name: name for name, path in known.items() if path.suffix == ".h"}
    written: defaultdict[str, Lines] = defaultdict(empty)
    emitted = []
    folders = sorted({path.parent for path in counts.rglob("*.gcno")})
    with ThreadPoolExecutor(usable_cores()) as pool:
        for folder, units in zip(folders, pool.map(gcov, folders), strict=True):
            of_model: defaultdict[str, Lines] = defaultdict(empty)
            for counted in units:
                for file in counted["files"]:
                    name = Path(file["file"]).name
                    source = folder / name
                    path = texts.get(source.read_bytes()) if source.is_file() else headers.get(name)
                    if path is None and name not in EMITTED:
                        continue  # the wrapper, and programs of tests
                    lines = of_model[name] if path is None else written[path]
                    for line in file["lines"]:
                        function = re.sub(r"^msfp_\d+_\d+_\d+_", "", line.get("function_name", ""))
                        lines.add(line["line_number"], line["count"] > 0, function)
            emitted += of_model.values()
    return dict(written), emitted


def gcov(folder: Path) -> list[dict]:
    """What gcov says of each unit whose notes are in a folder."""
    notes = sorted(path.name for path in folder.glob("*.gcno"))
    command = ["gcov", "--json-format", "--stdout", *notes]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines() if line.strip()]


def sources(rows: Mapping[str, tuple[str, ...]], pattern: str) -> dict[str, str]:
    """Path in the checkout of each file -> its row."""
    found = {}
    for row, folders in rows.items():
        for folder in folders:
            place = ROOT / folder
            for path in [place] if place.is_file() else sorted(place.glob(pattern)):
                found[path.relative_to(ROOT).as_posix()] = row
    return found


# ---- the page

PAGE = """<!-- Written by `make coverage` (benchmarks/line_coverage.py): do not edit. -->
# Line coverage

Which lines of the physics the tests run. `make coverage` runs the tests, counts and writes this page; it fails where a
test fails and where a row of physics is below {least} %. It is not part of CI.

## What is counted

*Physics* is what decides the numbers of a run, from the equations to what is read off its rows: in Python the packages
and files of the first table, in C the hand-written runtime of every model, and the runs of buildings and of estimates. Commands,
figures, reports, studies and the build of models are not.

The tests are a choice, {count} of the fast suite, so that the whole suite runs at least these lines. They are those of
{tests}.

A line of Python counts as coverage.py says: statements, without docstrings, comments and imports for types. A line of C
counts where gcc makes code of it in any of the models that the tests build ({models} of them), compiled with
`--coverage -O0`; it ran if it ran in one of them. Lines for other operating systems are not compiled, so they are not counted.

## Python

{python}

## C

{c}

The rows below *all* are not of physics. `embedding/assets/fmi` are the functions of a standard, many of which only refuse what a
bearing does not have ([fmu.md](fmu.md)). *Emitted* C, the kernels and drivers that the generator writes for each model, is
counted as the sum over all models, of which many are built for one question, so it says little. What is emitted is
compared with an independent reference at random states (`tests/physics/test_equations.py`), its derivatives with
differences (`tests/physics/test_tangents.py`), and its text with golden copies (`tests/golden/`).

## What did not run

Sorted by words in the lines and in the two before them, so that the kinds are a first impression:

{kinds}

{files}

## What this does not show

- A line that ran was not necessarily checked: that is what [mutants](../benchmarks/README.md) are for (`make mutants`).
- Lines are no branches: of `a || b` one side may never have decided, and of `c ? a : b` either half.
- A line of C that ran in one model may not have run in another, where the same text has other dimensions.
- Processes of a pool that `multiprocessing` forks end without writing counts of C; what ran in them alone is missing.
- A hundred percent would not mean that the equations are right: [validation](validation.md), [verification](verification.md).
"""


class Row(NamedTuple):
    """Lines of a package or a folder."""

    name: str
    lines: int
    ran: int

    def __str__(self) -> str:
        return f"| {self.name} | {self.lines} | {self.ran} | {percent(self)} |"


def percent(row: Row) -> str:
    """Share of the lines that ran, rounded down, so that 100.0 means all."""
    return f"{1000 * row.ran // row.lines / 10:.1f}" if row.lines else "–"


def rows(found: Mapping[str, Lines], row_of: Mapping[str, str]) -> list[Row]:
    """One row for each group of files, and their sum."""
    total: dict[str, list[int]] = {}
    for path, row in row_of.items():
        lines = found.get(path, empty())
        for name in (row, "all"):
            count = total.setdefault(name, [0, 0])
            count[0] += len(lines.ran)
            count[1] += sum(lines.ran.values())
    everything = total.pop("all")
    return [Row(f"`{name}`", *count) for name, count in total.items()] + [Row("all", *everything)]


def table(head: Iterable[str], lines: Iterable[object]) -> str:
    head = list(head)
    return "\n".join([f"| {' | '.join(head)} |", f"|{'---|' * len(head)}", *map(str, lines)])


# ---- what did not run

# The first whose pattern is in the lines or in the two before them. Kind -> pattern, in Python and C.
KINDS = {
    "memory that the system refuses": r"\b[mc]alloc\(|E_MEMORY|room_for\(|reserve\(",
    "input and calls that are refused": r"InputError|TypeError|msfp_refuse|E_ARGUMENT|E_SNAPSHOT|REQUIRE\(|\bvalid",
    "runs that end with an error": r"RunError|E_[A-Z]+\b|\bstatus\b|failed",
    "numbers that are not finite": r"NAN\b|INFINITY|HUGE_VAL|FINITE|isfinite|\bnan\b|\binf\b",
}
OTHER = "other"


class Block(NamedTuple):
    """Lines that did not run, with nothing between them that did, in one function."""

    path: str
    function: str
    numbers: tuple[int, ...]
    kind: str


def blocks(found: Mapping[str, Lines], row_of: Mapping[str, str]) -> Iterator[Block]:
    """All lines of some files that did not run."""
    for path in row_of:
        lines = found.get(path, empty())
        text = (ROOT / path).read_text(encoding="utf-8").splitlines()
        together: list[int] = []
        before = 0
        for number, ran in [*sorted(lines.ran.items()), (0, True)]:
            if not ran and (not together or lines.function[number] == lines.function[together[-1]]):
                together.append(number)
                continue
            if together:
                said = "\n".join(text[max(before - 2, 0) : together[-1]])
                kind = next((kind for kind, pattern in KINDS.items() if re.search(pattern, said)), OTHER)
                yield Block(path, lines.function[together[0]], tuple(together), kind)
            together = [] if ran else [number]
            before = number if ran else before


def kinds(python: Iterable[Block], c: Iterable[Block]) -> Iterator[str]:
    """Rows: lines that did not run, by what they are for."""
    counts: dict[str, Counter[str]] = {"Python": Counter(), "C": Counter()}
    for language, found in (("Python", python), ("C", c)):
        for block in found:
            counts[language][block.kind] += len(block.numbers)
    for kind in (*KINDS, OTHER):
        yield f"| {kind} | {counts['Python'][kind]} | {counts['C'][kind]} |"


def files(found: Mapping[str, Lines], row_of: Mapping[str, str], missed: Iterable[Block]) -> Iterator[str]:
    """Rows: each file with lines that did not run, and the functions that they are in."""
    functions: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for block in missed:
        functions[block.path][block.function or "module"] += len(block.numbers)
    for path, counts in functions.items():
        lines = found.get(path, empty())
        row = Row(f"`{path}`", len(lines.ran), sum(lines.ran.values()))
        named = ", ".join(f"`{name}` {count}" for name, count in sorted(counts.items()))
        yield f"{row} {named} |"


def page(
    python: Mapping[str, Lines], c: Mapping[str, Lines], emitted: Iterable[Lines], numbers: Mapping[str, str]
) -> str:
    """Text of docs/coverage.md. numbers: what the run itself gives, for the template."""
    of_python = sources(PYTHON, "**/*.py")
    of_c = {**sources(C, "*.c"), **sources(C, "*.h")}
    of_units = {**sources(INTERFACE, "*.c"), **sources(INTERFACE, "*.h")}
    made = Row("emitted, of all models", sum(len(x.ran) for x in emitted), sum(sum(x.ran.values()) for x in emitted))
    missed = [*blocks(python, of_python)], [*blocks(c, of_c)]
    head = ("lines", "ran", "%")
    return PAGE.format(
        **numbers,
        python=table(("package", *head), rows(python, of_python)),
        c=table(("folder of `msfp_gen/`", *head), [*rows(c, of_c), *rows(c, of_units)[:1], made]),
        kinds=table(("lines that did not run", "Python", "C"), kinds(*missed)),
        files=table(
            ("file", *head, "functions, and how many of their lines did not run"),
            [*files(python, of_python, missed[0]), *files(c, of_c, missed[1])],
        ),
    )


def low(text: str) -> list[str]:
    """Rows of physics on a page that are below the least share."""
    found = re.findall(r"^\| `((?!embedding/assets/)[\w/, ]+)` \| \d+ \| \d+ \| ([\d.]+) \|$", text, re.MULTILINE)
    return [f"{name}: {share} %" for name, share in found if float(share) < LEAST]


def main() -> None:
    """Run, count, write the page. SystemExit where a row of physics is low."""
    options = parser(__doc__)
    options.add_argument("--resume", action="store_true", help="go on with a run that was stopped, of the same sources")
    given = options.parse_args()
    missing = [name for name in ("gcc", "gcov") if shutil.which(name) is None]
    if missing or not installed("coverage", "all of it"):
        raise SystemExit(f"not installed: {', '.join(missing)}: no line of C is counted" if missing else None)
    folder = FOLDER.with_name("coverage-quick") if QUICK else FOLDER
    begin(folder, given.resume)
    tests = run_tests(folder)
    of_c = {**sources(C | INTERFACE, "*.c"), **sources(C | INTERFACE, "*.h")}
    python = of_python(folder)
    c, emitted = read_c(folder / "counts", {name: ROOT / name for name in of_c})
    numbers = {
        "least": f"{LEAST:.0f}",
        "count": str(tests),
        "tests": textwrap.fill(", ".join(f"`{path}`" for paths in TESTS for path in paths), 118),
        "models": str(len(list((folder / "models").glob("msfp_*/manifest.json")))),
    }
    text = page(python, c, emitted, numbers)
    with replacing(docs_folder() / "coverage.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    print("\n".join(line for line in text.splitlines() if re.match(r"^\| (?:`[^.]+`|all|emitted)", line)))
    if (failed := low(text)) and not QUICK:
        raise SystemExit(f"below {LEAST:.0f} %: {'; '.join(failed)}")


if __name__ == "__main__":
    main()
