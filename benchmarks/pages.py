"""Measure the tables of docs/accuracy.md, effects.md and performance.md: `python benchmarks/pages.py` (`make figures`).

Above a measured table stands a comment with its command, such as `<!-- python benchmarks/auto.py -->`. Each command runs
once, and its n-th comment gets the n-th table that it prints. The day beside the command becomes today, and the line
that begins with "Measured by" gets the machine, the version and the commit. Tables that a command prints beyond these
are in `build/figures`, with all that it prints. docs/accuracy.md comes from its template, whose tables are measured
first. An hour on two cores without other load; `--page NAME` measures one page. Numbers within sentences are not
changed: read the pages afterwards.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path

from quick import OPTIONS, QUICK, docs_folder, labelled, parser, pick

from msfp_gen.common.output import replacing
from msfp_gen.studies.accuracy.study import machine

ROOT = Path(__file__).resolve().parents[1]
PAGES = {
    "effects": ROOT / "docs" / "effects.md",
    "performance": ROOT / "docs" / "performance.md",
    "accuracy": ROOT / "benchmarks" / "accuracy.md.in",  # last, since accuracy.py then writes the page
}
MARKED = re.compile(r"<!-- (python [^>\n]*?) -->\n\n?((?:\|.*\n)+)")
TABLE = re.compile(r"^\|.*\n\|[-| :]+\|\n(?:\|.*(?:\n|$))*", re.MULTILINE)
STAMP = re.compile(r"^Measured by .* on \d{4}-\d\d-\d\d: processor .*$", re.MULTILINE)


def commands(text: str) -> list[str]:
    """The commands of the measured tables of a page, each once."""
    return list(dict.fromkeys(command for command, _ in MARKED.findall(text)))


def filled(text: str, outputs: dict[str, str], today: str) -> str:
    """The page with the tables of all outputs, command -> what it printed, and their day."""
    tables: dict[str, Iterator[str]] = {name: iter(TABLE.findall(output)) for name, output in outputs.items()}

    def measured(match: re.Match[str]) -> str:
        command, old = match.groups()
        new = next(tables.get(command, iter(())), old if QUICK or command not in tables else None)
        if new is None:
            raise SystemExit(f"{command}: it prints fewer tables than the page has")
        return match[0].replace(old, f"{new.rstrip()}\n")

    text = MARKED.sub(measured, text)
    for command in outputs:
        text = re.sub(rf"(`{re.escape(command)}`[^`\d]{{1,3}})20\d\d-\d\d-\d\d", rf"\g<1>{today}", text)
    return text


def stamp(today: str) -> str:
    """The line of a page about day and machine."""
    about = "; ".join(f"{name} {value}" for name, value in machine().items())
    return f"Measured by `python benchmarks/pages.py` on {today}: {about}."


def printed(command: str, folder: Path) -> str:
    """What a command prints, which goes to a file of the folder too. Raises CalledProcessError where it fails."""
    begin = time.perf_counter()
    words = [sys.executable, *shlex.split(command)[1:], *OPTIONS]
    text = subprocess.run(words, cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout
    (folder / f"{re.sub(r'[^a-z]+', '-', command)}.txt").write_text(text, encoding="utf-8")
    print(f"{command}: {(time.perf_counter() - begin) / 60:.1f} min", flush=True)
    return text


def measure(path: Path, target: Path, run: Callable[[str], str]) -> None:
    """Measure the tables of a page, and write it to the target. run: command -> what it prints."""
    text, today = path.read_text(encoding="utf-8"), f"{date.today()}"
    text = filled(text, {command: run(command) for command in commands(text)}, today)
    text = STAMP.sub(lambda _: stamp(today), text)
    with replacing(target) as temporary:
        temporary.write_text(labelled(text), encoding="utf-8")


def main() -> None:
    """Measure the pages."""
    options = parser(__doc__)
    options.add_argument("--page", choices=PAGES, nargs="*", default=list(pick(PAGES, ("effects",))))
    given = options.parse_args()
    outputs = docs_folder().parent / "build" / "figures"
    outputs.mkdir(parents=True, exist_ok=True)
    for name in given.page:
        path = PAGES[name]
        measure(path, docs_folder() / path.name if QUICK else path, lambda command: printed(command, outputs))
    if "accuracy" in given.page:
        subprocess.run([sys.executable, ROOT / "benchmarks" / "accuracy.py", *OPTIONS], check=True)


if __name__ == "__main__":
    main()
