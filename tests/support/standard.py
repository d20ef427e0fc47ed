"""Conformity of a unit with its standard: its description, the headers that its C follows, its functions, its C."""

from __future__ import annotations

import ctypes
import importlib.util
import re
import subprocess
import sys
from pathlib import Path

from msfp_gen.jit.compiler import find_compiler

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only")


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
    header = f"fmi{version}FunctionTypes.h"  # with which the compiler compares every definition
    official, own = (declared((folder / header).read_text(encoding="utf-8"), version) for folder in (headers, sources))
    assert len(official) > 40, "the headers were not understood"
    found += [f"{name}: not as in the standard" for name in official | own if official.get(name) != own.get(name)]
    library = ctypes.CDLL(str(next((folder / "binaries").rglob("*.so"))))
    found += [f"{name}: not exported" for name in official if not hasattr(library, name)]
    found += ["msfp_5_2_2: exported"] if hasattr(library, "msfp_5_2_2") else []
    files = [str(path) for path in sorted(sources.glob("fm[iu]*.c"))]
    done = subprocess.run([*find_compiler().command, *STRICT, *files], capture_output=True, text=True)
    return [*found, *([done.stderr] if done.returncode else [])]


def declared(text: str, version: int) -> dict[str, str]:
    """Types of functions in a header: name -> types of the result and the arguments."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.DOTALL)
    pattern = rf"typedef\s+([\w* ]+?)\s*(fmi{version}\w+)TYPE\s*\((.*?)\);"
    found = re.findall(pattern, text, flags=re.DOTALL)
    return {
        name: re.sub(r"\s", "", re.sub(r"([\w*])\s+\w+(\[\])?(?=[,)])", r"\1\2", f"{result}({arguments})"))
        for result, name, arguments in found
    }
