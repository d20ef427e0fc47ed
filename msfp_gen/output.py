"""Writing files: the path is judged before the work, and a file appears whole or not at all."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from secrets import token_hex

from msfp_gen.errors import InputError

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
DATASET_SUFFIXES = (".nc",)


def check_output(path: str | Path, suffixes: Collection[str], name: str = "output") -> Path:
    """`path` if a file of one of `suffixes` can be put there; InputError that begins with `name` otherwise."""
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise InputError(f"{name} = {str(path)!r}: give a name that ends in {' or '.join(suffixes)}")
    if path.is_dir():
        raise InputError(f"{name} = {str(path)!r}: this is a folder; give a file name")
    check_folder(path.parent, name)
    return path


def check_folder(folder: Path, name: str = "output") -> None:
    """InputError unless `folder` exists and can be written to."""
    if not folder.is_dir():
        raise InputError(f"{name}: folder {str(folder)!r} does not exist; create it or give another")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{name}: folder {str(folder)!r} cannot be written to; give another")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path`, renamed to `path` when the block succeeds and removed when it fails.

    A process that is killed while it writes leaves its temporary file; the next write to `path` clears it away.
    """
    clear_leftovers(path)
    temporary = path.with_name(f".{path.stem}-{token_hex(4)}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path, parts: Iterable[bytes | memoryview]) -> None:
    """Write a file, whole or not at all; it is on the disk before it takes its name. OSError where the disk refuses."""
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.writelines(parts)
        file.flush()
        os.fsync(file.fileno())


def clear_leftovers(path: Path, age: float = 3600.0) -> None:
    """Remove temporary files beside `path` that nobody has written to for `age` seconds."""
    limit = time.time() - age
    for left in path.parent.glob(f".{escape(path.stem)}-{'[0-9a-f]' * 8}{escape(path.suffix)}"):
        with suppress(OSError):
            if left.stat().st_mtime <= limit:
                left.unlink()


def make_folder(folder: Path, name: str = "output") -> None:
    """Make `folder` if it is not there; InputError that begins with `name` if that cannot be or it cannot be used."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{name} = {str(folder)!r}: {error.strerror}; give another folder") from error
    check_folder(folder, name)
