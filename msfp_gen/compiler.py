"""The compile room: finds the C compiler and turns sources into one extension module.

`compile_extension` writes the sources, runs Cython and the compiler on them (two commands at a time) and links.
Nothing here changes the process: every tool runs as a subprocess with its own working folder, and every command
with its output goes to `build.log` beside the sources.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import NamedTuple

from msfp_gen.errors import CompileError

JOBS = 2
LOG_NAME = "build.log"
EXTENSION_SUFFIX = EXTENSION_SUFFIXES[0]
PLATFORM_COMPILERS = ("cc", "gcc", "clang")

# Warnings are shown in the log; that there are none (-Werror) is tested, not asked of a user's newer compiler.
# MSFP_GEN_CFLAGS adds flags for the model's C, such as -march=native for a machine of one's own.
FLAGS: dict[str, tuple[str, ...]] = {
    "c": (
        "-std=c99", "-Wall", "-Wextra", "-fPIC", "-fvisibility=hidden", "-O2", "-fno-math-errno", "-fno-trapping-math",
        "-ffp-contract=off",
    ),
    # A batch agrees with one run at a time to rounding: a product and a sum may be one operation, a quotient a product.
    "lanes": ("-O3", "-ffp-contract=fast", "-freciprocal-math", "-Wno-psabi"),
    "user": tuple(shlex.split(os.environ.get("MSFP_GEN_CFLAGS", ""))),
    # Cython's own output is not ours to keep free of warnings, and it is not where the time goes.
    "wrapper": ("-w", "-fPIC", "-fvisibility=hidden", "-fno-strict-overflow", "-DNDEBUG", "-O1"),
    "libraries": ("-lm",),
}

LANES: dict[int, tuple[str, ...]] = {
    8: ("-march=x86-64-v4",),
    4: ("-march=x86-64-v3",),
    2: (),
}
"""Runs side by side in a vector -> what tells the compiler of the vectors: AVX-512, AVX2, and what every x86-64 has."""

# What the first line that explains a failure looks like: gcc and clang, Cython, the linker.
FAILURES = (
    re.compile(r"^\S+:\d+(?::\d+)?: (?:fatal )?error: .*$", re.MULTILINE),
    re.compile(r"^\S+\.pyx:\d+:\d+: .*$", re.MULTILINE),
    re.compile(r"^.*(?:undefined reference|undefined symbol|multiple definition|Error:).*$", re.MULTILINE),
)


@dataclass(frozen=True)
class Compiler:
    """A C compiler that answered: its words on the command line, where it lies, what it calls itself."""

    command: tuple[str, ...]
    path: str
    version: str


class Step(NamedTuple):
    """One command and the file it is about."""

    subject: str
    command: tuple[str, ...]


def find_compiler() -> Compiler:
    """The compiler named by `CC`, else the one Python was built with, else cc, gcc or clang on the path.

    Raises
    ------
    CompileError
        If there is none; the line says what was looked for and how to get one.

    """
    chosen = os.environ.get("CC", "").strip()
    candidates = [chosen] if chosen else [sysconfig.get_config_var("CC") or "", *PLATFORM_COMPILERS]
    for candidate in filter(None, candidates):
        words = shlex.split(candidate)
        path = shutil.which(words[0])
        if path is not None and (version := _version(words)):
            return Compiler(tuple(words), path, version)
    looked = f"CC={chosen}" if chosen else ", ".join(dict.fromkeys(filter(None, candidates)))
    raise CompileError(
        f"no C compiler found (looked for {looked}): install one (apt install gcc, xcode-select --install, "
        "conda install c-compiler) or name it with CC=..."
    )


def check_headers() -> Path:
    """The folder that holds `Python.h`; a `CompileError` with the remedy if the headers are not installed."""
    include = Path(sysconfig.get_path("include"))
    if not (include / "Python.h").is_file():
        raise CompileError(f"Python.h is not in {include}: install the Python headers (apt install python3-dev)")
    return include


def compile_extension(
    sources: dict[str, str], module: str, folder: Path, progress: Callable[[int, int], None] | None = None,
    extra: Mapping[str, tuple[str, ...]] | None = None,
) -> Path:  # fmt: skip
    """Write `sources` into `folder` and build the extension `module` there.

    Parameters
    ----------
    sources
        File name -> text: any number of `.c` and `.h` files and the wrapper `<module>.pyx`.
    module
        Name under which the extension is imported.
    folder
        A folder of the caller's; sources, `build.log` and the extension stay there, also after a failure.
    progress
        Called with how many C files are compiled, and how many there are.
    extra
        File name -> flags that this file alone takes as well.

    Returns
    -------
    Path
        The extension, `folder / (module + EXTENSION_SUFFIX)`.

    Raises
    ------
    CompileError
        If a tool is missing or refuses a file; one line with the file, the first error and the log.

    """
    compiler, include = find_compiler(), check_headers()
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="utf-8")
    log = Log(folder)
    units = sorted(name for name in sources if name.endswith(".c"))
    more = extra or {}
    chains = [_wrapper(module, compiler, include), *([_unit(name, compiler, more.get(name, ()))] for name in units)]
    for done in _at_once(chains, log.run):
        if progress is not None:
            progress(done, len(chains))
    objects = [_object(name) for name in [*units, f"{module}.c"]]
    target = folder / f"{module}{EXTENSION_SUFFIX}"
    log.run(Step(target.name, (*_linker(compiler), *objects, "-o", target.name, *FLAGS["libraries"])))
    for name in objects:
        (folder / name).unlink()
    return target


class Log:
    """Runs steps in a folder and records each command and its output in the folder's `build.log`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / LOG_NAME
        self.path.write_text("", encoding="utf-8")

    def run(self, step: Step) -> None:
        """Run one step; raise `CompileError` if it fails."""
        # English messages, so that the first error can be recognised.
        environment = {**os.environ, "LC_ALL": "C"}
        done = subprocess.run(
            step.command, cwd=self.folder, env=environment, text=True, errors="replace",
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        command = shlex.join(step.command)
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(f"$ {command}\n{done.stdout}[exit {done.returncode}]\n\n")
        if done.returncode != 0:
            message = f"cannot compile {step.subject}: {first_error(done.stdout, done.returncode)} (log: {self.path})"
            raise CompileError(message, command=command, log=self.path, output=done.stdout)


def first_error(output: str, code: int) -> str:
    """The one line of a tool's output that says what is wrong."""
    for pattern in FAILURES:
        if found := pattern.search(output):
            return found.group().strip()
    lines = output.split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), f"exit code {code} and no output")


def _at_once(chains: Sequence[Sequence[Step]], run: Callable[[Step], None]) -> Iterator[int]:
    """Run every chain, `JOBS` of them at a time, and count them as they end; after a failure none is started."""

    def follow(chain: Sequence[Step]) -> None:
        for step in chain:
            run(step)

    with ThreadPoolExecutor(JOBS) as pool:
        tasks = [pool.submit(follow, chain) for chain in chains]
        try:
            yield 0
            for count, task in enumerate(as_completed(tasks), start=1):
                task.result()
                yield count
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _unit(name: str, compiler: Compiler, extra: tuple[str, ...]) -> Step:
    return Step(name, (*compiler.command, *FLAGS["c"], *extra, *FLAGS["user"], "-c", name, "-o", _object(name)))


def _wrapper(module: str, compiler: Compiler, include: Path) -> list[Step]:
    """Cython's wrapper: translated in a Python of its own (`-P`: the folder is not on its path), then compiled."""
    pyx, c = f"{module}.pyx", f"{module}.c"
    cython = (sys.executable, "-P", "-m", "cython", "-3", pyx, "-o", c)
    return [
        Step(pyx, cython),
        Step(c, (*compiler.command, *FLAGS["wrapper"], "-I", str(include), "-c", c, "-o", _object(c))),
    ]


def _linker(compiler: Compiler) -> tuple[str, ...]:
    """The platform's way to link an extension, said with our compiler."""
    platform = shlex.split(sysconfig.get_config_var("LDSHARED") or "cc -shared")
    return (*compiler.command, *platform[1:])


def _object(name: str) -> str:
    return f"{Path(name).stem}.o"


def _version(words: Sequence[str]) -> str:
    """First line of `cc --version`; empty if it fails, as a placeholder that only offers to install one does."""
    done = subprocess.run([*words, "--version"], text=True, errors="replace", capture_output=True)
    return done.stdout.partition("\n")[0].strip() if done.returncode == 0 else ""
