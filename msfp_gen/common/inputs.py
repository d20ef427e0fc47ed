"""Input files: the one place where the files of a scene are opened, so that what was read is known.

Records, matrices and tables of factors are read by `read_input`. Inside `recording()` it notes the sha256 of every file
that is read; inside `expecting(files)` it refuses a file that is not as it was noted. What is made of a file is kept in
`InputCache` by the sha256 of its bytes, never by its name or its time.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from hashlib import sha256
from pathlib import Path
from typing import Generic, TypeVar

from msfp_gen.common.errors import RunError

T = TypeVar("T")
Files = dict[str, str]
"""Path of a file, as it was opened and absolute -> sha256 of its bytes."""

_notes: ContextVar[tuple[Files, ...]] = ContextVar("notes", default=())
_expected: ContextVar[Mapping[str, str] | None] = ContextVar("expected", default=None)


class ChangedFileError(RunError):
    """A file is not as it was when its digest was taken, was not read then, or cannot be read now."""


@contextmanager
def recording() -> Iterator[Files]:
    """Note the files that the block reads, also in a block inside it; a file that changes meanwhile is an error."""
    files: Files = {}
    token = _notes.set((*_notes.get(), files))
    try:
        yield files
    finally:
        _notes.reset(token)


@contextmanager
def expecting(files: Mapping[str, str]) -> Iterator[None]:
    """Refuse to read other files, or files with other bytes, in the block. Raises ChangedFileError there."""
    token = _expected.set(files)
    try:
        yield
    finally:
        _expected.reset(token)


def read_input(path: Path, most: int = -1) -> bytes:
    """The bytes of a file, at most `most` of them. Raises OSError, and ChangedFileError where others are expected."""
    try:
        with path.open("rb") as file:
            content = file.read(most)
    except OSError as error:
        if _expected.get() is None:
            raise
        raise _changed(path, f"it cannot be read here: {error.strerror or error}") from None
    _note(path, sha256(content).hexdigest())
    return content


def is_input(path: Path) -> bool:
    """Whether a file can be read: it is a regular file, or it is expected, so that its loss is another error."""
    try:
        return str(path.absolute()) in (_expected.get() or ()) or path.is_file()
    except (OSError, ValueError):  # such as a null character in its name
        return False


def digest_of(path: Path) -> str:
    """The sha256 of a file, which counts as read: the expected one if there is. Errors as in `read_input`."""
    digest = (_expected.get() or {}).get(str(path.absolute()))
    if digest is None:
        return sha256(read_input(path)).hexdigest()
    _note(path, digest)
    return digest


def _note(path: Path, digest: str) -> None:
    expected, name = _expected.get(), str(path.absolute())
    if expected is not None and expected.get(name) != digest:
        raise _changed(path, "it has changed since" if name in expected else "it was not read then")
    for files in _notes.get():
        if files.setdefault(name, digest) != digest:
            raise _changed(path, "it has changed since")


def _changed(path: Path, why: str) -> ChangedFileError:
    return ChangedFileError(f"{path}: not as it was when it was first read ({why}); run the same command again")


class InputCache(Generic[T]):
    """The values that were made last, by their keys, of at most so much size in all; for threads too."""

    def __init__(self, most: int, size: Callable[[T], int]) -> None:
        self._most, self._size = most, size
        self._values: OrderedDict[str, T] = OrderedDict()
        self._lock = threading.Lock()

    def value(self, key: str, make: Callable[[], T]) -> T:
        """The value of a key, made where it is not kept."""
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                return self._values[key]
        value = make()
        with self._lock:
            self._values[key] = value
            while len(self._values) > 1 and sum(map(self._size, self._values.values())) > self._most:
                self._values.popitem(last=False)
        return value
