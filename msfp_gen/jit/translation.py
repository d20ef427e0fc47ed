"""C code of the wrapper: the same for every model, so Cython translates it once and the cache of models keeps it.

A translation is a file `wrapper-<key>.c` whose first line is the sha256 of the rest. One that is damaged is not used.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from contextlib import suppress
from pathlib import Path

from msfp_gen.common.output import write_bytes
from msfp_gen.jit.cache import cache_root, tool_version, write_errors

_NAME = re.compile(r"wrapper-[0-9a-f]{20}\.c")


def translation_path(pyx: str) -> Path:
    """Where the cache keeps the translation of a wrapper by the installed Cython."""
    key = hashlib.sha256(f"{tool_version('cython')}\0{pyx}".encode()).hexdigest()
    return cache_root() / f"wrapper-{key[:20]}.c"


def find_translation(pyx: str) -> str | None:
    """C code of a wrapper; None if the cache does not hold it."""
    path = translation_path(pyx)
    try:
        digest, _, text = path.read_bytes().partition(b"\n")
        os.utime(path)  # records the time of last use for `remove_translations`
    except OSError:
        return None
    return text.decode() if hashlib.sha256(text).hexdigest().encode() == digest else None


def keep_translation(pyx: str, c: Path) -> None:
    """Store the C file that Cython made of a wrapper."""
    text = c.read_bytes()
    path = translation_path(pyx)
    with write_errors(path.parent):
        write_bytes(path, (hashlib.sha256(text).hexdigest().encode(), b"\n", text))


def remove_translations(days: float) -> None:
    """Delete the translations that were not used for `days` days."""
    root = cache_root()
    for path in root.iterdir() if root.is_dir() else ():
        with suppress(OSError):
            if _NAME.fullmatch(path.name) and path.stat().st_mtime <= time.time() - days * 86400.0:
                path.unlink()
