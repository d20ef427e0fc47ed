"""Checks of the installation, printed by `msfp-gen doctor`."""

from __future__ import annotations

import platform
import re
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from time import perf_counter

from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.tables import Table
from msfp_gen.jit.build import find_prebuilt, load_extension, prebuilt_specs
from msfp_gen.jit.cache import cache_root
from msfp_gen.jit.compiler import check_headers, compile_extension, find_compiler

DISTRIBUTION = "msfp-gen"
FREE_DISK = 200e6  # [bytes] space for several dozen compiled models
TEST_SOURCES = {
    "msfp_doctor.pyx": "def answer():\n    return 42\n",
    "msfp_unit.c": "int msfp_unit(void) { return 42; }\n",
}


@dataclass(frozen=True)
class CheckResult:
    """Result of one check.

    Attributes:
        name: what was checked.
        ok: whether it is as required.
        detail: what was found.
        remedy: what to do if it is not as required.
    """

    name: str
    ok: bool
    detail: str
    remedy: str = ""


def diagnose() -> list[CheckResult]:
    """Check Python, each dependency, models of the wheel, compiler, headers, a small build, cache folder and disk."""
    return [
        check_python(),
        *check_dependencies(),
        check_prebuilt(),
        check_compiler(),
        check_python_headers(),
        check_build(),
        check_cache(),
        check_disk(),
    ]


def check_python() -> CheckResult:
    """Version of the running Python against `Requires-Python` of the distribution."""
    required = _requires_python()
    return CheckResult(
        "python",
        sys.version_info[: len(required)] >= required,
        f"{platform.python_version()} at {sys.executable}",
        f"install Python {_dotted(required)} or later",
    )


def check_dependencies() -> list[CheckResult]:
    """Installed version of each declared dependency against its lower bound."""
    try:
        declared = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return [CheckResult(DISTRIBUTION, False, "not installed", "pip install . in the checkout")]
    return [_check_requirement(line) for line in declared if "extra ==" not in line]


def check_prebuilt() -> CheckResult:
    """The models that came compiled; a sound installation may have none."""
    try:
        count = sum(find_prebuilt(spec) is not None for spec in prebuilt_specs())
    except InputError as error:
        return CheckResult("prebuilt models", False, *_found_and_remedy(error))
    detail = f"{count} that need no compiler" if count else "none: a model is compiled at its first use"
    return CheckResult("prebuilt models", True, detail)


def check_compiler() -> CheckResult:
    """The C compiler that builds would use."""
    try:
        compiler = find_compiler()
    except (CompileError, InputError) as error:
        return CheckResult("C compiler", False, *_found_and_remedy(error))
    return CheckResult("C compiler", True, f"{' '.join(compiler.command)} at {compiler.path}: {compiler.version}")


def check_python_headers() -> CheckResult:
    """The header `Python.h`, which the compilation of models needs."""
    try:
        return CheckResult("Python headers", True, str(check_headers()))
    except CompileError as error:
        return CheckResult("Python headers", False, *_found_and_remedy(error))


def check_build() -> CheckResult:
    """Cython, compiler and linker: builds and imports a module of one function."""
    begin = perf_counter()
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = compile_extension(TEST_SOURCES, "msfp_doctor", Path(folder))
            correct = load_extension(path, "msfp_doctor").answer() == 42
    except (CompileError, InputError, OSError) as error:
        return CheckResult("build a module", False, str(error), "resolve the failed checks above first")
    return CheckResult(
        "build a module", correct, f"{perf_counter() - begin:.1f} s", "the module was built but returns a wrong value"
    )


def check_cache() -> CheckResult:
    """Whether the cache folder of compiled models is writable."""
    root = cache_root()
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            return CheckResult("model cache", True, str(root))
    except OSError as error:
        remedy = "set MSFP_GEN_CACHE to a folder that you can write"
        return CheckResult("model cache", False, f"cannot write {root} ({error.strerror or error})", remedy)


def check_disk() -> CheckResult:
    """Free disk space of the cache folder."""
    root = cache_root()
    existing = next(folder for folder in (root, *root.parents) if folder.exists())
    free = shutil.disk_usage(existing).free
    detail = f"{free / 1e9:.1f} GB free at {existing}"
    return CheckResult("free disk", free > FREE_DISK, detail, f"free {FREE_DISK / 1e6:.0f} MB, or set MSFP_GEN_CACHE")


def _check_requirement(line: str) -> CheckResult:
    """Check of one line of the declared dependencies, such as `numpy>=1.26`."""
    match = re.match(r"([\w.-]+)\s*(?:>=\s*([\d.]+))?", line)
    if match is None:
        raise InputError(f"requirement {line!r} of {DISTRIBUTION}: cannot read it; install msfp-gen again")
    name, least = match.group(1), match.group(2) or "0"
    remedy = f'pip install "{name}>={least}"'
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return CheckResult(name, False, "not installed", remedy)
    return CheckResult(name, _numbers(version) >= _numbers(least), version, remedy)


def _requires_python() -> tuple[int, ...]:
    try:
        return _numbers((metadata.metadata(DISTRIBUTION)["Requires-Python"] or "0").lstrip(">= "))
    except metadata.PackageNotFoundError:
        return (0,)


def _found_and_remedy(error: CompileError | InputError) -> Iterator[str]:
    """The two parts of a CompileError of the form `what was found: remedy`."""
    problem, _, remedy = str(error).partition(": ")
    yield from (problem, remedy)


def _numbers(version: str) -> tuple[int, ...]:
    """The leading release numbers of a version."""
    return tuple(int(part) for part in re.findall(r"\d+", re.sub(r"[^\d.].*", "", version)))


def _dotted(numbers: tuple[int, ...]) -> str:
    return ".".join(map(str, numbers))


def check_table(checks: Iterable[CheckResult]) -> Table:
    """Result of `msfp-gen doctor`, one row per check."""
    rows = [
        (check.name, *(("ok", check.detail) if check.ok else ("MISSING", f"{check.detail}; {check.remedy}")))
        for check in checks
    ]
    return Table("msfp-gen doctor", (), rows)
