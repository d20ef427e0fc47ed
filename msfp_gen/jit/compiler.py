"""C compiler: finds it and compiles sources to one extension module.

`compile_extension` writes the sources, runs Cython and the compiler on them in parallel and links. Every tool runs as a
subprocess with its own working folder, so the state of this process does not change. Commands and their
output are written to `build.log` beside the sources.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import NamedTuple

from msfp_gen.common.cores import usable_cores
from msfp_gen.common.errors import CompileError, InputError
from msfp_gen.common.output import write_bytes, write_text

COMPILER, CFLAGS = "CC", "MSFP_GEN_CFLAGS"
# With these a compiler assumes that no number is infinite or NaN and drops the checks for them.
FORBIDDEN = ("-Ofast", "-ffast-math", "-ffinite-math-only")


def words_of_variable(name: str) -> tuple[str, ...]:
    """The words of an environment variable. Raises InputError where a quote is not closed, or a flag is forbidden."""
    text = os.environ.get(name, "")
    try:
        flags = tuple(shlex.split(text))
    except ValueError as error:
        raise InputError(f"{name} = {text!r}: {str(error).lower()}; quote it as for a shell") from None
    if bad := [flag for flag in flags if flag in FORBIDDEN]:
        raise InputError(
            f"{name} = {text!r}: {bad[0]} removes the checks that every number is finite; leave it out "
            "(-O3 and -march=native may stay)"
        )
    return flags


def user_flags() -> tuple[str, ...]:
    """The words of MSFP_GEN_CFLAGS; none where these are refused, which `find_compiler` then reports."""
    try:
        return words_of_variable(CFLAGS)
    except InputError:
        return ()


LOG_NAME = "build.log"
EXTENSION_SUFFIX = EXTENSION_SUFFIXES[0]
PLATFORM_COMPILERS = ("cc", "gcc", "clang")
# The compiler of the package ziglang compiles for the processor at hand and with traps for undefined behaviour, unless
# it is told not to.
ZIG_OPTIONS = ("cc", "-mcpu=baseline", "-fno-sanitize=undefined")

# Warnings appear in the log only: a newer compiler of a user may warn where the compilers of the tests (-Werror) do
# not. MSFP_GEN_CFLAGS adds flags for the C code of models, such as -march=native.
FLAGS: dict[str, tuple[str, ...]] = {
    "c": (
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-fPIC",
        "-fvisibility=hidden",
        "-O2",
        "-fno-math-errno",
        "-fno-trapping-math",
        "-ffp-contract=off",
    ),
    "user": user_flags(),
    # Cython's output causes warnings and takes little of the run time: no warnings, no optimisation, which compiles in
    # 1.2 s instead of 2.0 s and makes a derivative for SciPy's integrators slower by a tenth.
    "wrapper": ("-w", "-fPIC", "-fvisibility=hidden", "-fno-strict-overflow", "-DNDEBUG", "-O0"),
    "libraries": ("-lm",),
}

# Patterns of the line that states an error: gcc and clang, Cython, the linker.
ERROR_PATTERNS = (
    re.compile(r"^\S+:\d+(?::\d+)?: (?:fatal )?error: .*$", re.MULTILINE),
    re.compile(r"^\S+\.pyx:\d+:\d+: .*$", re.MULTILINE),
    re.compile(r"^.*(?:undefined reference|undefined symbol|multiple definition|Error:).*$", re.MULTILINE),
)


@dataclass(frozen=True)
class Compiler:
    """A C compiler that runs on this machine.

    Attributes:
        command: its command line, as separate words.
        path: the executable.
        version: first line of its `--version`.
    """

    command: tuple[str, ...]
    path: str
    version: str


class BuildStep(NamedTuple):
    """One command of a build; `subject` is the file that it processes."""

    subject: str
    command: tuple[str, ...]


def find_compiler() -> Compiler:
    """The compiler that `CC` names, else the one that built Python, else cc, gcc or clang on the path, else ziglang.

    ziglang is a package with a C compiler, the extra "compiler" of msfp-gen.

    Raises
    ------
    CompileError
        If none runs; the message lists the names that were tried and how to install one.
    InputError
        CC or MSFP_GEN_CFLAGS has an open quote or a flag that is not permitted.

    """
    words_of_variable(CFLAGS)
    chosen = shlex.join(words_of_variable(COMPILER))
    candidates = [chosen] if chosen else [sysconfig.get_config_var("CC") or "", *PLATFORM_COMPILERS]
    commands = [shlex.split(candidate) for candidate in filter(None, candidates)]
    if not chosen and (zig := zig_program()) is not None:
        commands.append([str(zig), *ZIG_OPTIONS])
    for command in commands:
        path = shutil.which(command[0])
        if path is not None and (version := _version(command)):
            return Compiler(tuple(command), path, version)
    tried = f"CC={chosen}" if chosen else ", ".join(dict.fromkeys(filter(None, candidates)))
    raise CompileError(
        f"no C compiler found (looked for {tried}): install one (apt install gcc, xcode-select --install, "
        "conda install c-compiler, or pip install ziglang) or name it with CC=..."
    )


def zig_program() -> Path | None:
    """The program of the package ziglang; None where it is not installed."""
    module = importlib.util.find_spec("ziglang")
    for folder in (module.submodule_search_locations or ()) if module is not None else ():
        if (program := Path(folder) / "zig").is_file():
            return program
    return None


def check_headers() -> Path:
    """Folder of `Python.h`. Raises CompileError with the remedy if the headers of Python are not installed."""
    include = Path(sysconfig.get_path("include"))
    if not (include / "Python.h").is_file():
        raise CompileError(f"Python.h is not in {include}: install the Python headers (apt install python3-dev)")
    return include


def compile_extension(
    sources: dict[str, str],
    module: str,
    folder: Path,
    progress: Callable[[int, int], None] | None = None,
    processor: Sequence[str] = (),
    libraries: Sequence[str] = (),
    kept: Path | None = None,
    shared: Path | None = None,
) -> Path:
    """Write `sources` into `folder` and build the extension `module` there.

    Parameters
    ----------
    sources
        File name -> text: any number of `.c` and `.h` files and one `.pyx`, the wrapper.
    module
        Name under which the extension is imported.
    folder
        Working folder; sources, `build.log` and the extension remain there, also after a failure.
    progress
        Called with the number of compiled C files and the number of all.
    processor
        Flags of the C files that select a processor; see `msfp_gen.jit.compiler`.
    libraries
        Options of the linker beside the ones that every extension has.
    kept
        Where the object of the wrapper is kept for other extensions with the same one. It is used where the file is as
        it was written, and written otherwise.
    shared
        Folder where objects of C files are kept for other extensions, see `compile_once`. None: none are.

    Returns
    -------
    Path
        The extension, `folder / (module + EXTENSION_SUFFIX)`.

    Raises
    ------
    CompileError
        If a tool is missing or rejects a file; one line with the file, the first error and the log.

    """
    compiler, include = find_compiler(), check_headers()
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in sources.items():
        write_text(folder / name, text)
    log = Log(folder)
    wrapper = next(Path(name).stem for name in sources if name.endswith(".pyx"))
    # The longest first, so that no processor waits for another in the end: the wrapper, then the files with kernels.
    units = [name for name in sorted(sources) if name.endswith(".c")]
    units.sort(key=lambda name: "msfp_kernels.h" not in sources[name])
    c_flags = (*FLAGS["c"], *processor, *FLAGS["user"])
    chains = [[compile_step(name, compiler, c_flags)] for name in units]
    known = read_kept(kept) if kept is not None else None
    if known is not None:
        write_bytes(folder / object_file(wrapper), [known])
    else:
        chains.insert(0, _wrapper_steps(wrapper, compiler, include))

    def run(step: BuildStep) -> None:
        if step.subject not in units:
            log.run(step)
        else:
            compile_once(step.subject, compiler, c_flags, log, shared)

    for done in run_parallel(chains, run):
        if progress is not None:
            progress(done, len(chains))
    objects = [object_file(name) for name in [*units, wrapper]]
    target = _linked(folder / f"{module}{EXTENSION_SUFFIX}", objects, compiler, libraries, log)
    if kept is not None and known is None:
        _keep(kept, (folder / object_file(wrapper)).read_bytes())
    for name in objects:
        (folder / name).unlink()
    (folder / f"{wrapper}.c").unlink(missing_ok=True)
    return target


def _linked(target: Path, objects: Sequence[str], compiler: Compiler, libraries: Sequence[str], log: Log) -> Path:
    """The extension of these objects. Raises CompileError."""
    options = (*FLAGS["libraries"], *libraries)
    log.run(BuildStep(target.name, (*_link_command(compiler), *objects, "-o", target.name, *options)))
    if not target.is_file():
        message = f"{shlex.join(compiler.command)} wrote no {target.name}: this is no C compiler; name one with CC=..."
        raise CompileError(message, log=log.path)
    return target


def read_kept(path: Path) -> bytes | None:
    """The object in a file that `compile_extension` kept; None if it is missing or damaged.

    The first line of the file is the sha256 of the rest.
    """
    with suppress(OSError):
        digest, _, content = path.read_bytes().partition(b"\n")
        if hashlib.sha256(content).hexdigest().encode() == digest:
            os.utime(path)  # records the time of last use for `msfp-gen cache --prune`
            return content
    return None


def _keep(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, [hashlib.sha256(content).hexdigest().encode(), b"\n", content], tidy=False)


class Log:
    """Runs the steps of a build in a folder and writes each command with its output to `build.log` there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / LOG_NAME
        write_text(self.path, "")

    def run(self, step: BuildStep) -> None:
        """Run one step. Raises CompileError if its exit status is not 0."""
        # `ERROR_PATTERNS` expect English messages.
        environment = {**os.environ, "LC_ALL": "C"}
        done = subprocess.run(
            step.command,
            cwd=self.folder,
            env=environment,
            text=True,
            errors="replace",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        command = shlex.join(step.command)
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(f"$ {command}\n{done.stdout}[exit {done.returncode}]\n\n")
        if done.returncode != 0:
            message = f"cannot compile {step.subject}: {first_error(done.stdout, done.returncode)} (log: {self.path})"
            raise CompileError(message, command=command, log=self.path, output=done.stdout)


def first_error(output: str, code: int) -> str:
    """The line of a tool's output that states the error; `code` is its exit status."""
    for pattern in ERROR_PATTERNS:
        if match := pattern.search(output):
            return match.group().strip()
    lines = output.split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), f"exit code {code} and no output")


def run_parallel(chains: Sequence[Sequence[BuildStep]], run: Callable[[BuildStep], None]) -> Iterator[int]:
    """Run all chains, one a processor at a time, and yield how many are finished; after a failure none is started."""

    def run_chain(chain: Sequence[BuildStep]) -> None:
        for step in chain:
            run(step)

    with ThreadPoolExecutor(usable_cores()) as pool:
        tasks = [pool.submit(run_chain, chain) for chain in chains]
        try:
            yield 0
            for count, task in enumerate(as_completed(tasks), start=1):
                task.result()
                yield count
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def compile_step(name: str, compiler: Compiler, flags: Sequence[str]) -> BuildStep:
    """Compilation of one C file; the object lies beside it."""
    return BuildStep(name, (*compiler.command, *flags, "-c", name, "-o", object_file(name)))


def compile_once(name: str, compiler: Compiler, flags: Sequence[str], log: Log, shared: Path | None) -> None:
    """Compile one C file, or take the object of the same preprocessed text by the same compiler from `shared`.

    Most files of the runtime read of a model its dimensions alone, and an edit of one leaves the text of the others.
    """
    if shared is None or FLAGS["user"]:  # flags of the user may write more than the object
        log.run(compile_step(name, compiler, flags))
        return
    text, target = log.folder / f"{name}.i", log.folder / object_file(name)
    log.run(BuildStep(name, (*compiler.command, *flags, "-E", "-P", name, "-o", f"{name}.i")))
    if not text.is_file():  # no C compiler, which is named where it has linked nothing
        log.run(compile_step(name, compiler, flags))
        return
    inputs = f"{compiler.command} {compiler.path} {compiler.version} {flags}\0{target.name}\0".encode()
    path = shared / f"{hashlib.sha256(inputs + text.read_bytes()).hexdigest()[:40]}.o"
    text.unlink()
    known = read_kept(path)
    if known is not None:
        write_bytes(target, [known], tidy=False)
        return
    log.run(compile_step(name, compiler, flags))
    _keep(path, target.read_bytes())


def _wrapper_steps(wrapper: str, compiler: Compiler, include: Path) -> list[BuildStep]:
    """Translation of the wrapper by Cython in a separate Python (`-P`: without the folder on its path), compilation."""
    pyx, c = f"{wrapper}.pyx", f"{wrapper}.c"
    cython = BuildStep(pyx, (sys.executable, "-P", "-m", "cython", "-3", pyx, "-o", c))
    command = (*compiler.command, *FLAGS["wrapper"], "-I", str(include), "-c", c, "-o", object_file(c))
    return [cython, BuildStep(c, command)]


def _link_command(compiler: Compiler) -> tuple[str, ...]:
    """The linker options that Python was built with, for the given compiler."""
    platform = shlex.split(sysconfig.get_config_var("LDSHARED") or "cc -shared")
    return (*compiler.command, *platform[1:])


def object_file(name: str) -> str:
    """Object of a C file, beside it."""
    return str(Path(name).with_suffix(".o"))


def _version(command: Sequence[str]) -> str:
    """First line of `<compiler> --version`; empty if that fails, as for a stub that only offers to install one."""
    try:
        done = subprocess.run([*command, "--version"], text=True, errors="replace", capture_output=True)
    except OSError:  # a file that is no program
        return ""
    return done.stdout.partition("\n")[0].strip() if done.returncode == 0 else ""


CPUINFO = Path("/proc/cpuinfo")
# Level of x86-64 -> the flags that Linux reports for what it adds to the level below (x86-64 psABI, table 3.1).
LEVELS = {
    2: "cx16 lahf_lm popcnt pni sse4_1 sse4_2 ssse3",
    3: "abm avx avx2 bmi1 bmi2 f16c fma movbe xsave",
    4: "avx512bw avx512cd avx512dq avx512f avx512vl",
}


def x86_64_level() -> int | None:
    """Level of this processor, 1 to 4; None if it is not an x86-64 or does not say."""
    if platform.machine() != "x86_64":
        return None
    try:
        lines = CPUINFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    flags = next((set(line.partition(":")[2].split()) for line in lines if line.startswith("flags")), None)
    if flags is None:
        return None
    reached = 1
    for level, needed in LEVELS.items():
        if not flags.issuperset(needed.split()):
            break
        reached = level
    return reached


def processor_flags(user: Sequence[str] = ()) -> tuple[str, ...]:
    """Flags with which C code is compiled for this processor alone.

    None where the processor is not known, or where `user`, the user's own flags, select one, as -march=native does.
    """
    level = x86_64_level()
    if level is None or any(flag.startswith("-m") for flag in user):
        return ()
    return (f"-DMSFP_X86_64_LEVEL={level}",)
