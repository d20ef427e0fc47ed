"""A round of mutants: one small change of the code each, and whether the tests see it.

    python tools/mutants.py --count 100 --seed 1

Mutants are drawn evenly from the parts of PARTS: generator, runtime (C), simulation and results. Each is made in a copy
of the checkout. First the test files run that import the changed module, or those of CHOSEN for its folder or file, then
those of its part, until the first failure. They are a choice of the fast suite, since a change of generator or runtime
builds every model anew; --suite runs all of it, --near only the first. Golden files are left out: they hold the text
of the generator, so that any change fails and none is judged. A mutant that survives and changes a number asks for a
test; --output writes the list as JSON and goes on with one that was begun. The exit code is 1 if the tests fail without a mutant.
"""

from __future__ import annotations

import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from fnmatch import fnmatch
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import QUICK, parser, pick

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Part:
    """Files that are mutated, the tests that must see it, and whether models are built anew."""

    files: str
    tests: tuple[str, ...]
    builds: bool = False


EQUATIONS = "tests/physics/test_equations.py"
RUNS = "tests/physics/test_runs.py"
PARTS = {
    "generator": Part("generator/*.py", (EQUATIONS, "tests/unit/generator"), True),
    "runtime": Part("msfp_gen/runtime/**/*.c", (RUNS, "tests/physics/test_loads.py"), True),
    "simulation": Part("msfp_gen/simulation/*.py", ("tests/unit/simulation",)),
    "results": Part("msfp_gen/results/**/*.py", ("tests/unit/results", "tests/unit/simulation/test_segment_ends.py")),
}
# Pattern of files that no test imports -> the tests of what they compute, those first that build few models.
CHOSEN: dict[str, tuple[str, ...]] = {
    "generator/latex.py": ("tests/unit/generator",),
    "generator/interface.py": ("tests/unit/generator", "tests/unit/embedding/test_library.py"),
    "generator/emit.py": (EQUATIONS, "tests/unit/generator", "tests/unit/results/test_extremes.py"),
    "generator/energy.py": (RUNS, "tests/physics/test_quasistatic.py"),
    "generator/two_port.py": ("tests/unit/embedding/test_two_port.py", "tests/physics/test_two_port.py"),
    "generator/laws.py": (
        "tests/physics/test_friction_laws.py",
        "tests/physics/test_hysteresis.py",
        EQUATIONS,
    ),
    "msfp_gen/specification/friction_laws.py": ("tests/physics/test_friction_laws.py",),
    "generator/unilateral.py": ("tests/physics/test_uplift.py",),
    "generator/top*.py": (EQUATIONS, "tests/physics/test_vertical_compliance.py"),
    "generator/lower.py": (EQUATIONS, "tests/physics/test_gradients.py", "tests/physics/test_tangents.py"),
    "generator/directions.py": ("tests/unit/generator", "tests/unit/embedding/test_two_port.py"),
    "generator/columns.py": (EQUATIONS, "tests/physics/test_gradients.py", "tests/physics/test_tangents.py"),
    "generator/schedule.py": (EQUATIONS, "tests/unit/generator"),
    "generator/drivers.py": (EQUATIONS, "tests/unit/generator", "tests/physics/test_gradients.py"),
    "generator/parameters.py": (EQUATIONS, "tests/physics/test_uplift.py", "tests/physics/test_gradients.py"),
    "*/runtime/equations/memory.c": ("tests/physics/test_friction_laws.py",),
    "*/runtime/equations/tangent_forward.c": ("tests/physics/test_uplift.py", "tests/physics/test_tangents.py"),
    "*/runtime/equations/contact_unilateral.c": ("tests/physics/test_uplift.py",),
    "*/runtime/equations/*": (EQUATIONS, "tests/physics/test_reference.py"),
    "*/runtime/steppers/quasistatic.c": ("tests/physics/test_quasistatic.py",),
    "*/runtime/steppers/*": ("tests/hard/test_convergence.py", "tests/unit/runtime/test_esdirk.py"),
    "msfp_gen/simulation/gradients.py": (
        "tests/unit/simulation/test_gradients.py",
        "tests/physics/test_gradients.py",
    ),
    "msfp_gen/simulation/outcome.py": ("tests/unit/simulation/test_notes.py", "tests/physics/test_hysteresis.py"),
    "*/runtime/run/monitors.c": (
        "tests/unit/simulation/test_auto.py",
        "tests/physics/test_friction_laws.py",
        "tests/unit/simulation/test_failures.py",
    ),
    "*/runtime/run/snapshot.c": ("tests/unit/simulation/test_checkpoint.py",),
    "*/runtime/run/*": (RUNS, "tests/hard/test_limits.py", "tests/hard/test_rims.py", "tests/hard/test_ladder.py"),
    "*/runtime/gradients/*": ("tests/physics/test_gradients.py", "tests/unit/simulation/test_gradients.py"),
    "*/runtime/port/*": ("tests/unit/embedding/test_two_port.py", "tests/physics/test_two_port.py"),
    "*/runtime/api/two_port.c": ("tests/unit/embedding/test_two_port.py", "tests/unit/embedding/test_two_port_in_c.py"),
    "*/runtime/api/*": ("tests/unit/test_python_users.py", "tests/unit/embedding/test_library.py"),
}
PATIENCE = 5.0  # a mutant may take that many times longer than the tests without one; a hang is seen


@dataclass(frozen=True)
class Mutant:
    """One replacement in one file, by its offsets in the text."""

    part: str
    path: str
    line: int
    start: int
    stop: int
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.before} -> {self.after}"

    def applied(self, text: str) -> str:
        return text[: self.start] + self.after + text[self.stop :]


# ---- changes

PYTHON: dict[type[ast.AST], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Pow: ("**", "*"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
C = [(" < ", " <= "), (" <= ", " < "), (" > ", " >= "), (" >= ", " > "), (" == ", " != "), (" != ", " == ")]
C += [(" + ", " - "), (" - ", " + "), (" * ", " / "), (" / ", " * "), (" && ", " || "), (" || ", " && ")]
C += [("fmin(", "fmax("), ("fmax(", "fmin("), (" += ", " -= "), (" -= ", " += ")]
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d*)?(?:e[+-]?\d+)?(?![\w.])")
NOT_CODE = re.compile(r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\])*\"|^#[^\n]*", re.DOTALL | re.MULTILINE)


def other_number(text: str) -> str:
    """Zero becomes one, a whole number the next one, any other is doubled."""
    if text.isdigit():
        return str(int(text) + 1)
    return repr(2.0 * float(text)) if float(text) else "1.0"


def python_mutants(part: str, path: str, text: str) -> Iterator[Mutant]:
    """Operators of comparison, arithmetic and logic, and numbers."""
    lines = [0]
    for line in text.encode().splitlines(keepends=True):
        lines.append(lines[-1] + len(line))

    def offset(row: int, column: int) -> int:  # of a character, from the bytes that `ast` counts
        return len(text.encode()[: lines[row - 1] + column].decode())

    def between(one: ast.expr, other: ast.expr, op: ast.AST) -> Iterator[Mutant]:
        if type(op) in PYTHON and one.end_lineno is not None and one.end_col_offset is not None:
            before, after = PYTHON[type(op)]
            begin, end = offset(one.end_lineno, one.end_col_offset), offset(other.lineno, other.col_offset)
            at = text.find(before, begin, end)
            if at >= 0:
                yield Mutant(part, path, one.end_lineno, at, at + len(before), before, after)

    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Compare):
            for one, op, other in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
                yield from between(one, other, op)
        elif isinstance(node, ast.BinOp):
            yield from between(node.left, node.right, node.op)
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.end_col_offset is not None:
            begin, end = offset(node.lineno, node.col_offset), offset(node.lineno, node.end_col_offset)
            if NUMBER.fullmatch(text[begin:end]):
                yield Mutant(part, path, node.lineno, begin, end, text[begin:end], other_number(text[begin:end]))


def c_mutants(part: str, path: str, text: str) -> Iterator[Mutant]:
    """The same in C, outside comments, strings and directives."""
    code = NOT_CODE.sub(lambda found: " " * len(found[0]) if "\n" not in found[0] else blank(found[0]), text)
    for before, after in C:
        for found in re.finditer(re.escape(before), code):
            line = code.count("\n", 0, found.start()) + 1
            yield Mutant(part, path, line, found.start(), found.end(), before, after)
    for found in NUMBER.finditer(code):
        line = code.count("\n", 0, found.start()) + 1
        yield Mutant(part, path, line, found.start(), found.end(), found[0], other_number(found[0]))


def blank(text: str) -> str:
    return re.sub(r"[^\n]", " ", text)


def drawn(count: int, seed: int, parts: list[str]) -> list[Mutant]:
    """`count` mutants, as many of each part, the parts in turn."""
    rng, found = random.Random(seed), []
    for name in parts:
        every: list[Mutant] = []
        for file in sorted(ROOT.glob(PARTS[name].files)):
            path, text = str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")
            every += (c_mutants if file.suffix == ".c" else python_mutants)(name, path, text)
        found.append(rng.sample(every, min(len(every), -(-count // len(parts)))))
    longest = max(map(len, found))
    return [mutants[i] for i in range(longest) for mutants in found if i < len(mutants)][:count]


def near(path: str) -> tuple[str, ...]:
    """Tests of the module at a path: those of CHOSEN, else the files of unit tests and hard cases that import it."""
    if chosen := next((tests for pattern, tests in CHOSEN.items() if fnmatch(path, pattern)), None):
        return chosen
    module = path.removesuffix(".py").replace("/", ".")
    name = re.compile(
        rf"from {re.escape(module)} import|{re.escape(module.rpartition('.')[0])} import .*\b{Path(path).stem}\b"
    )
    files = [*ROOT.glob("tests/unit/**/test_*.py"), *ROOT.glob("tests/hard/test_*.py")]
    found = [file for file in files if path.startswith("msfp_gen") and name.search(file.read_text(encoding="utf-8"))]
    return tuple(sorted(str(file.relative_to(ROOT)) for file in found))


# ---- a copy of the checkout, and its tests


class Copy:
    """A copy of the tracked files, in which one mutant at a time is tested, up to a limit of time [s] or a measured one."""

    def __init__(self, folder: Path, limit: float | None) -> None:
        self.folder, self.limit, self.times = folder, limit, dict[tuple[str, ...], float]()
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split("\0")):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name, follow_symlinks=False)

    def tested(self, part: str, tests: tuple[str, ...], limit: float | None) -> str:
        """How tests end: "passed", "failed" or "hung"."""
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-m", "not slow", "-p", "no:cacheprovider"]
        cache = self.folder / "models" if PARTS[part].builds else ROOT / "build" / "models"
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "MSFP_GEN_CACHE": str(cache)}
        with subprocess.Popen(
            [*command, *tests], cwd=self.folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            try:
                code = process.wait(limit)
            except subprocess.TimeoutExpired:
                process.kill()
                return "hung"
        return "passed" if code == 0 else "failed"

    def measure(self, part: str, tests: tuple[str, ...]) -> None:
        """Run tests without a mutant and keep their time, once. Raises RuntimeError where they fail."""
        if tests in self.times:
            return
        begin = time.perf_counter()
        if self.tested(part, tests, None) != "passed":
            raise RuntimeError(f"{' '.join(tests)} fail without a mutant")
        self.times[tests] = time.perf_counter() - begin
        self.forget()

    def forget(self) -> None:
        """Delete the models of a mutant; what Cython made of the wrapper stays."""
        for entry in (self.folder / "models").glob("msfp_*"):
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()

    def end_of(self, mutant: Mutant, stages: list[tuple[str, ...]]) -> str:
        """How the tests end with a mutant: those of each stage, until one fails."""
        for tests in filter(None, stages if self.limit is None else []):
            self.measure(mutant.part, tests)
        file = self.folder / mutant.path
        text = file.read_text(encoding="utf-8")
        file.write_text(mutant.applied(text), encoding="utf-8")
        try:
            for tests in filter(None, stages):
                limit = 60.0 + PATIENCE * self.times[tests] if self.limit is None else self.limit
                end = self.tested(mutant.part, tests, limit)
                if end != "passed":
                    return end
            return "survived"
        finally:
            file.write_text(text, encoding="utf-8")
            self.forget()


def main(words: list[str] | None = None) -> int:
    """Test a round of mutants and print those that survive; returns the exit code."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=pick(100, 1))
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--part", choices=list(PARTS), action="append", help="only this part; may be given again")
    group = options.add_mutually_exclusive_group()
    group.add_argument("--suite", action="store_true", help="the whole fast suite for every mutant")
    group.add_argument(
        "--near", action="store_true", default=QUICK, help="only the tests that import the changed module"
    )
    options.add_argument("--list", action="store_true", help="print the mutants, and test none")
    options.add_argument(
        "--limit", type=float, help="time of a stage of tests [s], in place of one measured beforehand"
    )
    options.add_argument("--output", type=Path, help="JSON file for the mutants and how their tests ended")
    given = options.parse_args(words)
    mutants = drawn(given.count, given.seed, given.part or pick(list(PARTS), ["results"]))
    if given.list:
        print(*mutants, sep="\n")
        return 0
    rows: list[dict[str, object]] = []
    if given.output is not None and given.output.exists():
        rows = json.loads(given.output.read_text(encoding="utf-8"))
    mutants = [mutant for mutant in mutants if not any(asdict(mutant).items() <= row.items() for row in rows)]
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Copy(Path(folder), given.limit)
        for mutant in mutants:
            first, rest = near(mutant.path), PARTS[mutant.part].tests
            rest = tuple(name for name in rest if name not in first)
            stages = [("tests",)] if given.suite else [first or rest] if given.near else [first, rest]
            try:
                rows.append({**asdict(mutant), "end": copy.end_of(mutant, stages)})
            except RuntimeError as error:
                print(error)
                return 1
            print(f"{rows[-1]['end']:9}{mutant}", flush=True)
            if given.output is not None:
                given.output.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print(", ".join(f"{number} {end}" for end, number in Counter(str(row["end"]) for row in rows).items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
