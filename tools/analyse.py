"""Static analysis of the C code: `gcc -fanalyzer`, clang-tidy and cppcheck (`make analyse`).

They read what a compiler reads: models with the runtime, the driver of buildings, and units (FMU),
in `build/analysis`. One model is planar without masses, one has every other effect, both have gradients: each line of
the runtime is in one of them. A program that is missing is named and left out. Exit code 1: there are findings.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from msfp_gen import Effects, Layout, Top, load_scene
from msfp_gen.common.cores import usable_cores
from msfp_gen.embedding.unit import write_fmu
from msfp_gen.generator import generate
from msfp_gen.jit import build
from msfp_gen.jit.build import runtime_sources
from msfp_gen.specification.layout import ModelSpec

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import QUICK, parser

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "build" / "analysis"
MODELS = {
    "planar": ModelSpec(Layout.tfp(), Effects(dimension="planar", sliders="massless"), gradients=True),
    "full": ModelSpec(
        Layout.tfp(), Effects(spin="patch", friction="pvt", uplift=True, top_rotation=True), gradients=True
    ),
}
SLOW = ("full",)  # for cppcheck, which follows every value through the kernels: minutes
DRIVERS = {"buildings": "msfp_gen.buildings"}
LANGUAGE = ("-std=c99", "-Wall", "-Wextra")
# -O1: functions are inlined, as where the analyser is run by its authors. Off: of gcc 12, the check of values that are
# not set does not follow arrays that a loop of a count in data fills; clang-tidy asks the same question, and
# tests/unit/runtime/test_sanitizers.py runs the code under valgrind.
GCC = ("gcc", *LANGUAGE, "-O1", "-fanalyzer", "-Wno-analyzer-use-of-uninitialized-value", "-c", "-o", os.devnull)
TIDY = ("clang-tidy", "--quiet")
CPPCHECK = (
    "cppcheck",
    "-q",
    "--std=c99",
    "--enable=warning,style,performance,portability",
    "--inline-suppr",
    f"--suppressions-list={ROOT / '.cppcheck'}",
    "--template={file}:{line}:{column}: warning: {message} [{id}]",
    "-D__GNUC__=12",  # one configuration: the others differ by the macros of a model, which its headers define
    "-U__cplusplus",
    "-U_WIN32",
)
FINDING = re.compile(
    r"^(?:.*/)?([^/\s]+:\d+:\d+): (?:warning|error|style|portability|performance): (.*)$", re.MULTILINE
)


class Task(NamedTuple):
    """One program on one C file in a folder."""

    folder: Path
    file: str
    command: tuple[str, ...]


def emit() -> dict[Path, list[str]]:
    """Write all sources; returns folder -> C files to analyse there."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    sources = {name: build.sources(ROOT.joinpath(*package.split("."), "compiled")) for name, package in DRIVERS.items()}
    sources = {name: {**files, **build.headers()} for name, files in sources.items()}
    if not QUICK:
        for name, spec in MODELS.items():
            sources[name] = {**runtime_sources(spec), **generate(spec).files}
        sources |= {f"fmi{version}": unit_sources(version) for version in (2, 3)}
    units = {}
    for name, files in sources.items():
        folder = FOLDER / name
        folder.mkdir(parents=True)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        only = "fmi*.c", "fmu*.c"
        found = [
            path.name for pattern in (only if name.startswith("fmi") else ("*.c",)) for path in folder.glob(pattern)
        ]
        units[folder] = sorted(found)
    return units


def unit_sources(version: int) -> dict[str, str]:
    """C files and headers of a unit (FMU) for Co-Simulation and, of a supported mass, Model Exchange."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    path = FOLDER / f"unit{version}.fmu"
    scene = replace(load_scene("fenz-test1"), top=Top.mass(1e4, 1e3, 1.0, 1e7, 1e4))
    write_fmu(scene, path, version=version, exchange=True)
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.startswith("sources/") and name.endswith((".c", ".h"))]
        return {Path(name).name: archive.read(name).decode() for name in names}


def findings(task: Task) -> set[str]:
    """Lines `file:line:column: text` of what a program reports."""
    done = subprocess.run(task.command, cwd=task.folder, capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    found = {f"{place}: {text}" for place, text in FINDING.findall(output) if not accepted(task, place, text)}
    if done.returncode and not found:
        found.add(f"{task.file}: {task.command[0]} ended with {done.returncode}: {output.strip()[-300:]}")
    return {f"{place} ({task.command[0]}, {task.folder.name})" for place in found}


def accepted(task: Task, place: str, text: str) -> bool:
    """Whether a comment `NOLINT(-Wname): reason` names a finding of gcc; the others look themselves."""
    if task.command[0] != "gcc":
        return False
    name, line, _ = place.split(":")
    source = (task.folder / name).read_text(encoding="utf-8").splitlines()[int(line) - 1]
    return any(f"NOLINT({flag})" in source for flag in re.findall(r"\[(-W[\w-]+)\]", text))


def main() -> None:
    """Run all programs on all files and print what they report."""
    parser(__doc__).parse_args()
    tasks = []
    units = emit()
    for words in (GCC, TIDY, CPPCHECK):
        if shutil.which(words[0]) is None:
            print(f"not installed: {words[0]}: its checks are left out", file=sys.stderr)
            continue
        last = ("--", "-std=c99") if words is TIDY else ()
        for folder, files in units.items():
            if words is not CPPCHECK or folder.name not in SLOW:
                tasks += [Task(folder, file, (*words, file, *last)) for file in files]
    with ThreadPoolExecutor(usable_cores()) as pool:
        found = sorted(set().union(*pool.map(findings, tasks)))
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = seconds.ru_utime + seconds.ru_stime
    count = sum(map(len, units.values()))
    print("\n".join([*found, f"{len(found)} findings in {count} C files, {used:.0f} s of CPU time"]))
    if found:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
