"""Processor, compiler and versions that measured times depend on."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

import numpy as np

from msfp_gen.errors import CompileError
from msfp_gen.version import __version__


def machine() -> dict[str, str]:
    """Name -> text: processor, cores, system, compiler, versions, commit of a checkout; without unknown ones."""
    found = {
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "compiler": _compiler(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "msfp_gen": __version__,
        "commit": _commit(),
    }
    return {name: value for name, value in found.items() if value}


def _compiler() -> str:
    from msfp_gen.jit.compiler import FLAGS, find_compiler

    try:
        return f"{find_compiler().version}, {' '.join(f for f in (*FLAGS['c'], *FLAGS['user']) if f[1:2] in 'Om')}"
    except CompileError:
        return "none found"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def _commit() -> str:
    """Commit of the git checkout that contains the package; empty if there is none."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists():
        return ""
    try:
        run = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout.strip()
