"""The options that every script has: `--quick` runs it once through, with few and short runs. Its numbers mean nothing.

A quick run writes no page and no figure of the checkout: what it would write there goes to a temporary folder.
"""

from __future__ import annotations

import sys
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from atexit import register
from functools import cache
from importlib import import_module
from pathlib import Path
from shutil import copytree, rmtree
from typing import TypeVar

T = TypeVar("T")
QUICK = "--quick" in sys.argv[1:]
DOCS = Path(__file__).resolve().parents[1] / "docs"
OPTIONS = ["--quick"] * QUICK  # of the scripts that a script starts
LABEL = "A quick run: few and short runs, and no number or table below is a measurement."


def pick(whole: T, little: T) -> T:
    """A setting of a script: the second one in a quick run."""
    return little if QUICK else whole


def parser(text: str | None) -> ArgumentParser:
    """A parser with the option `--quick`; the script reads it here, when its settings are made."""
    if QUICK:
        print(LABEL, flush=True)
    made = ArgumentParser(description=text, formatter_class=RawDescriptionHelpFormatter)
    made.add_argument(
        "--quick", action="store_true", help="once through, with few and short runs; numbers mean nothing"
    )
    return made


def labelled(page: str) -> str:
    """A page, which says first that it is no measurement where a quick run made it."""
    return f"{LABEL}\n\n{page}" if QUICK else page


@cache
def docs_folder() -> Path:
    """The pages and figures that a script reads and writes: those of this checkout, in a quick run a copy."""
    if not QUICK:
        return DOCS
    folder = Path(tempfile.mkdtemp())
    register(rmtree, folder, ignore_errors=True)
    return Path(copytree(DOCS, folder / "docs", ignore=lambda *_: ["site"]))


def installed(module: str, part: str, extra: str = "peers") -> bool:
    """Whether a module of an extra can be imported; if not, one line says what a script leaves out without it."""
    try:
        import_module(module)
    except Exception as error:  # OpenSeesPy raises RuntimeError where a library of the system is missing
        print(f"left out, since {module} cannot be imported ({error}); pip install -e .[{extra}]: {part}", flush=True)
        return False
    return True
