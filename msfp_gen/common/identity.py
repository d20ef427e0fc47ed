"""`fingerprint`: the identity of a run, of a part of a study or of a kept value, from all that it is computed from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

_NONE: Mapping[str, str] = {}
NO_NUMBERS = {"no_numbers": True}
"""Metadata of a field of a dataclass on which no number of a run depends."""


def fingerprint(value: object, files: Mapping[str, str] = _NONE) -> str:
    """The sha256 of all values in dataclasses, mappings, lists and arrays; equal for equal values.

    Of a resolved scene these are its numbers and texts, the polynomials of motions and the matrices of a building;
    fields with `NO_NUMBERS` are left out.
    files: path -> sha256, as `inputs.recording` notes them: a text that is such a path counts as the name of the file
    and its bytes, wherever its folder lies.
    """
    digest = hashlib.sha256()
    for item in _leaves(value, files):
        digest.update(b"%d:" % len(item) + item)
    return digest.hexdigest()


def _leaves(value: Any, files: Mapping[str, str]) -> Iterator[bytes]:
    """The values as bytes, with types and lengths."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode()
        yield (value + 0 if value.dtype.kind == "f" else value).tobytes()  # -0.0 equals 0.0
    elif is_dataclass(value) and not isinstance(value, type):
        yield type(value).__name__.encode()
        for field in fields(value):
            if field.compare and not field.metadata.get("no_numbers"):
                yield field.name.encode()
                yield from _leaves(getattr(value, field.name), files)
    elif isinstance(value, Mapping):
        yield b"{%d" % len(value)
        for key in sorted(value):
            yield repr(key).encode()
            yield from _leaves(value[key], files)
    elif isinstance(value, list | tuple):
        yield b"%d" % len(value)
        for item in value:
            yield from _leaves(item, files)
    elif isinstance(value, str) and value in files:
        yield repr((PurePath(value).name, files[value])).encode()
    else:
        yield repr(value).encode()
