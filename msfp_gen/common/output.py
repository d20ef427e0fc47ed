"""Output files: paths are checked before any computation, and a file is written completely or not at all."""

from __future__ import annotations

import os
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from secrets import token_hex

from msfp_gen.common.errors import InputError

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
DATASET_SUFFIXES = (".nc",)


def check_output(path: str | Path, suffixes: Collection[str], name: str = "output") -> Path:
    """`path`, if a file with one of `suffixes` can be written there. Raises InputError that begins with `name`."""
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        raise InputError(f"{name} = {str(path)!r}: give a name that ends in {' or '.join(suffixes)}")
    if path.is_dir():
        raise InputError(f"{name} = {str(path)!r}: this is a folder; give a file name")
    check_folder(path.parent, name)
    return path


def check_folder(folder: Path, name: str = "output") -> None:
    """Raise InputError that begins with `name` unless `folder` exists and is writable."""
    if not folder.is_dir():
        raise InputError(f"{name}: folder {str(folder)!r} does not exist; create it or give another")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{name}: folder {str(folder)!r} cannot be written to; give another")


@contextmanager
def replacing(path: Path, *, tidy: bool = True) -> Iterator[Path]:
    """A temporary path beside `path`: renamed to `path` if the block succeeds, deleted if it raises.

    A process that is killed while writing leaves its temporary file behind; a later write to `path` deletes it. tidy:
    whether to look for such files, which takes time in a folder of many thousands.
    """
    if tidy:
        clear_leftovers(path)
    temporary = path.with_name(f".{path.stem}-{token_hex(4)}{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        if error.filename is not None and str(error.filename) != str(temporary):
            raise
        # A full disk names no file, other errors name the temporary one.
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path, parts: Iterable[bytes | memoryview], *, tidy: bool = True) -> None:
    """Write a file completely or not at all: the bytes are flushed to disk before the file is renamed to `path`.

    tidy: see `replacing`. Raises OSError if the disk is full or the folder is not writable.
    """
    with replacing(path, tidy=tidy) as temporary, temporary.open("wb") as file:
        file.writelines(parts)
        file.flush()
        os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Write a text file with the line ends of the text. Raises OSError that names the file, also on a full disk."""
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


OLD = 3600.0  # age from which no process is still writing a temporary file [s]


def clear_leftovers(path: Path, age: float = OLD) -> None:
    """Delete temporary files of `path` that were last modified at least `age` [s] ago.

    Younger ones may belong to a process that is still writing.
    """
    _clear(path.parent, escape(path.stem), path.suffix, age)


def clear_all_leftovers(folder: Path, suffix: str) -> None:
    """Delete the temporary files, as in `clear_leftovers`, of all files in `folder` that end in `suffix`."""
    _clear(folder, "*", suffix, OLD)


def _clear(folder: Path, stem: str, suffix: str, age: float) -> None:
    limit = time.time() - age
    for temporary in folder.glob(f".{stem}-{'[0-9a-f]' * 8}{escape(suffix)}"):
        with suppress(OSError):
            if temporary.stat().st_mtime <= limit:
                temporary.unlink()


def make_folder(folder: Path, name: str = "output") -> None:
    """Create `folder` if it does not exist. Raises InputError that begins with `name` if it cannot be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{name} = {str(folder)!r}: {error.strerror}; give another folder") from error
    check_folder(folder, name)
