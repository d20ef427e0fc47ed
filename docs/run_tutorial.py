"""Run the commands of docs/tutorial.md: `python docs/run_tutorial.py FOLDER [PAGE]`. Tests and figures use this script.

A block marked `sh` contains commands, one per line. A block marked `toml` or `python` is a file named in its first
line. A block marked `text` is the output of the preceding commands; lines, and the rest of a line after `...`, may be
left out. The first block of commands of the tutorial installs the package and is not run; blocks without a mark are not
followed.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import QUICK, docs_folder, parser

PAGE = Path(__file__).resolve().parent / "tutorial.md"
PICTURES = ("tutorial.png", "tutorial-section.png")


class Block(NamedTuple):
    """A fenced block: its language and its text."""

    language: str
    text: str


class Step(NamedTuple):
    """Commands, their complete output, and the output that the page shows."""

    commands: list[str]
    printed: str
    shown: str


def blocks(page: Path = PAGE) -> list[Block]:
    """All fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    return [Block(*found) for found in re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)]


def run(command: str, folder: Path) -> str:
    """Run a command of the page with the Python of this process; returns its output."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    words, variables = shlex.split(command, comments=True), {**os.environ, "PATH": path}
    done = subprocess.run(words, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command}: exit code {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def follow(folder: Path, run: Callable[[str, Path], str] = run, page: Path = PAGE) -> Iterator[Step]:
    """Follow a page in `folder`; yields one step per block of commands. `run` runs a command in the folder."""
    rest = blocks() if page == PAGE else blocks(page)
    if page == PAGE:
        assert rest.pop(0).language == "sh", "the page begins with the installation"
    step = None
    for language, text in rest:
        if language == "text" and step is not None:
            step = step._replace(shown=text)
            continue
        if not language:
            continue
        if step is not None:
            yield step
            step = None
        if language == "sh":
            commands = text.splitlines()
            step = Step(commands, "".join(run(command, folder) for command in commands), "")
        else:
            (folder / text.split()[1]).write_text(text, encoding="utf-8")
    if step is not None:
        yield step


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", type=Path, **({"nargs": "?", "default": docs_folder()} if QUICK else {}))
    options.add_argument("page", nargs="?", type=Path, default=PAGE)
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for done in follow(given.folder, page=given.page):
        print(*(f"$ {command}" for command in done.commands), done.printed, sep="\n")
