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


def conforms(unit: Path, version: int) -> None:
    """The XML is valid, all functions are there with the types of the official headers, the C compiles strictly."""
    import fmpy
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []
    if importlib.util.find_spec("fmu_manipulation_toolbox") is not None:
        command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", str(unit), "-check"]
        done = subprocess.run(command, capture_output=True, text=True)
        text = done.stdout + done.stderr
        assert f"seems to be compliant with FMI-{version}.0" in text and "No semantic error" in text, text
    folder = Path(str(fmpy.extract(str(unit))))
    sources, headers = folder / "sources", Path(fmpy.__file__).parent / "c-code"
    official = declared((headers / f"fmi{version}FunctionTypes.h").read_text(encoding="utf-8"), version)
    found = defined(sources / f"fmi{version}.c", version)
    assert set(found) == set(official) and len(found) > 40
    for name in set(official) - UNNAMED:
        assert found[name] == official[name], name
    library = ctypes.CDLL(str(next((folder / "binaries").rglob("*.so"))))
    assert all(hasattr(library, name) for name in official)
    assert not hasattr(library, "msfp_5_2_2")
    files = [str(path) for path in sorted(sources.glob("fm[iu]*.c"))]
    subprocess.run([*find_compiler().command, *STRICT, *files], check=True)


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
