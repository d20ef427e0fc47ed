"""Conformity of a unit with its standard: its description, its functions and their types, its C."""

from __future__ import annotations

import ctypes
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

from msfp_gen.jit.compiler import find_compiler

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only")
# Its callbacks without a name of their own have no typedef in the sources.
UNNAMED = {"fmi3InstantiateScheduledExecution"}


def objections(unit: Path, version: int) -> list[str]:
    """What the standard has against a unit: its XML, functions that are missing or of other types, C with warnings."""
    import fmpy
    from fmpy.validation import validate_fmu

    found = [str(problem) for problem in validate_fmu(str(unit))]
    if importlib.util.find_spec("fmu_manipulation_toolbox") is not None:
        command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", str(unit), "-check"]
        done = subprocess.run(command, capture_output=True, text=True)
        text = done.stdout + done.stderr
        passed = f"seems to be compliant with FMI-{version}.0" in text and "No semantic error" in text
        found += [] if passed else [text]
    folder = Path(str(fmpy.extract(str(unit))))
    sources, headers = folder / "sources", Path(fmpy.__file__).parent / "c-code"
    official = declared((headers / f"fmi{version}FunctionTypes.h").read_text(encoding="utf-8"), version)
    functions = defined(sources / f"fmi{version}.c", version)
    assert len(official) > 40, "the headers were not understood"
    found += [f"{name}: in one of unit and standard" for name in set(functions) ^ set(official)]
    found += [
        f"{name}: {functions[name]}, not {official[name]}"
        for name in (set(official) & set(functions)) - UNNAMED
        if functions[name] != official[name]
    ]
    library = ctypes.CDLL(str(next((folder / "binaries").rglob("*.so"))))
    found += [f"{name}: not exported" for name in official if not hasattr(library, name)]
    found += ["msfp_5_2_2: exported"] if hasattr(library, "msfp_5_2_2") else []
    files = [str(path) for path in sorted(sources.glob("fm[iu]*.c"))]
    done = subprocess.run([*find_compiler().command, *STRICT, *files], capture_output=True, text=True)
    return [*found, *([done.stderr] if done.returncode else [])]


def plain(types: str) -> list[str]:
    """Types of arguments without their names, arrays as pointers."""
    found = []
    for argument in re.sub(r"\s+", " ", types).split(","):
        words = argument.strip()
        kind = re.sub(r"\w+(\[\])?$", r"\1", words) if re.search(r"[ *]\w+(\[\])?$", words) else words
        found.append(kind.replace("[]", "*").replace(" ", ""))
    return [] if found in (["void"], [""]) else found


def declared(text: str, version: int) -> dict[str, tuple[str, list[str]]]:
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    pattern = rf"typedef\s+([\w* ]+?)\s*(fmi{version}\w+)TYPE\s*\((.*?)\);"
    return {
        name: (kind.replace(" ", ""), plain(types)) for kind, name, types in re.findall(pattern, text, flags=re.DOTALL)
    }


def defined(source: Path, version: int) -> dict[str, tuple[str, list[str]]]:
    done = subprocess.run(
        [*find_compiler().command, "-E", "-P", str(source)], capture_output=True, text=True, check=True
    )
    pattern = rf"\)\)\) ([\w* ]+?)\s*(fmi{version}\w+)\(((?:[^()]|\([^()]*\))*)\)\s*\{{"
    text = re.sub(r"\s+", " ", done.stdout)
    return {name: (kind.replace(" ", ""), plain(types)) for kind, name, types in re.findall(pattern, text)}
