"""Do what docs/tutorial.md says: `python docs/run_tutorial.py FOLDER`. For its test, and for its pictures.

A block marked `sh` is commands, one a line; one marked `toml` or `python` is the file that its first line names; one
marked `text` is what the commands before it print: lines, and what is behind `...`, are left out. The first block of
commands installs, and is not run.
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

PAGE = Path(__file__).resolve().parent / "tutorial.md"
PICTURES = ("tutorial.png", "tutorial-section.png")


class Block(NamedTuple):
    """A fenced block: its language and its text."""

    language: str
    text: str


class Step(NamedTuple):
    """Commands that were run, everything they printed, and what the page shows of it."""

    commands: list[str]
    printed: str
    shown: str


def blocks() -> list[Block]:
    """Every fenced block of the page, in order."""
    text = PAGE.read_text(encoding="utf-8")
    return [Block(*found) for found in re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)]


def run(command: str, folder: Path) -> str:
    """Run a command of the page with the Python of this process; what it prints."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    words, variables = shlex.split(command, comments=True), {**os.environ, "PATH": path}
    done = subprocess.run(words, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command}: exit code {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout


def follow(folder: Path, run: Callable[[str, Path], str] = run) -> Iterator[Step]:
    """Follow the page in `folder`; a step for every block of commands. `run` takes each command and the folder."""
    install, *rest = blocks()
    assert install.language == "sh", "the page begins with the installation"
    step = None
    for language, text in rest:
        if language == "text" and step is not None:
            step = step._replace(shown=text)
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
    where = Path(sys.argv[1])
    where.mkdir(parents=True, exist_ok=True)
    for done in follow(where):
        print(*(f"$ {command}" for command in done.commands), done.printed, sep="\n")
