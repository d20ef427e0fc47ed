"""Ways to forge a result file: valid HDF5 whose content is not what `Result.to_netcdf` writes."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

WRONG: list[Any] = [
    "",
    "nan",
    "\x1b[2J",
    "[" * 9000,
    '{"a": 1}',
    "[[1]]",
    "a.b = 1\n" * 3,
    -1,
    2**62,
    float("nan"),
    float("inf"),
    np.arange(3),
    np.zeros((2, 2)),
    np.zeros(0),
    np.array([b"bytes"]),
    np.array(1 + 2j),
    np.zeros(1, dtype=[("a", float), ("b", int)]),
    True,
    h5py.Empty("f"),
]


def any_object(file: h5py.File, dice: random.Random) -> h5py.Group | h5py.Dataset:
    """A group or a dataset of the file."""
    found: list[Any] = [file]
    file.visititems(lambda _, item: found.append(item))
    return dice.choice(found)


def any_dataset(file: h5py.File, dice: random.Random) -> h5py.Dataset:
    """A dataset of the file that has values."""
    found: list[Any] = []
    file.visititems(lambda _, item: found.append(item) if isinstance(item, h5py.Dataset) and item.size else None)
    return dice.choice(found)


def fixed(text: bytes) -> Any:
    """A text of fixed length, as in a result."""
    return np.array(text, h5py.string_dtype(length=max(len(text), 1)))


def an_attribute(file: h5py.File, dice: random.Random) -> None:
    """An attribute that another type, another value or another name takes."""
    item = dice.choice([file, file, any_object(file, dice)])
    name = dice.choice(list(item.attrs) or ["scene"])
    value = item.attrs[name]
    del item.attrs[name]
    if isinstance(value, bytes) and value and dice.random() < 0.5:
        at = dice.randrange(len(value))
        other = dice.choice(["", "9", "e308", "'", "[", "nan", "\n", "ü"])
        item.attrs[name] = fixed(value[:at] + other.encode() + value[at + 1 :])
    elif dice.random() < 0.8:
        wrong = dice.choice(WRONG)
        item.attrs[name] = fixed(wrong.encode()) if isinstance(wrong, str) and dice.random() < 0.8 else wrong


def nothing_there(file: h5py.File, dice: random.Random) -> None:
    """A dataset or a group that is missing, or a group where a dataset was."""
    item = any_dataset(file, dice)
    parent, name = item.parent, item.name
    del parent[name]
    if dice.random() < 0.5:
        parent.create_group(name)


def a_link(file: h5py.File, dice: random.Random) -> None:
    """A dataset that is a link to another one, to another file or to nothing."""
    item = any_dataset(file, dice)
    parent, name = item.parent, item.name
    del parent[name]
    links: list[Any] = [h5py.SoftLink("/time"), h5py.SoftLink("/none"), h5py.SoftLink(name)]
    parent[name] = dice.choice([*links, h5py.ExternalLink("other.nc", name), h5py.ExternalLink("/dev/zero", name)])


def another_array(file: h5py.File, dice: random.Random) -> None:
    """A dataset of another shape, type or storage."""
    item = any_dataset(file, dice)
    parent, name, shape, values = item.parent, item.name, item.shape, item[()]
    del parent[name]
    large = (10**9, *shape[1:])
    dice.choice(
        [
            lambda: parent.create_dataset(name, shape=large, dtype=float, chunks=(2**16, *shape[1:])),
            lambda: parent.create_dataset(name, shape=shape, dtype=float, chunks=True, maxshape=(None, *shape[1:])),
            lambda: parent.create_dataset(name, shape=large, dtype=float, chunks=(2**16, *shape[1:]), compression=9),
            lambda: parent.create_dataset(
                name, shape=shape, dtype=float, external=[("/dev/zero", 0, h5py.h5f.UNLIMITED)]
            ),
            lambda: parent.create_dataset(name, data=np.zeros(shape)[1:]),
            lambda: parent.create_dataset(name, data=np.full(shape, np.nan)),
            lambda: parent.create_dataset(name, data=np.full(shape, 1e300)),
            lambda: parent.create_dataset(name, data=np.full(shape, b"text")),
            lambda: parent.create_dataset(name, data=np.zeros(shape, np.float32)),
            lambda: parent.create_dataset(name, data=np.zeros(shape, [("a", float, (1000,))])),
            lambda: parent.create_dataset(name, data=np.zeros(shape, [("a", float, (1000,))])),
            lambda: parent.create_dataset(name, data=3.0),
            lambda: parent.create_dataset(name, data=h5py.Empty("f")),
            lambda: parent.create_dataset(name, data=values, compression="lzf"),
            lambda: parent.create_dataset(
                name, data=np.array([b"x" * 100000] * shape[0], object), dtype=h5py.string_dtype()
            ),
            lambda: parent.create_virtual_dataset(name, virtual(shape, name)),
        ]
    )()


def virtual(shape: tuple[int, ...], name: str) -> h5py.VirtualLayout:
    """A dataset whose values lie in another file."""
    layout = h5py.VirtualLayout(shape=shape, dtype=float)
    layout[...] = h5py.VirtualSource("other.nc", name, shape=shape)
    return layout


def other_values(file: h5py.File, dice: random.Random) -> None:
    """A number or a text among the values."""
    item = any_dataset(file, dice)
    values = item[()]
    at = tuple(dice.randrange(size) for size in values.shape)
    others: dict[str, list[Any]] = {"S": [b"x"], "f": [1e300, -1e300, 0.0, 7.0], "i": [-1, 0, 7, 2**30]}
    values[at] = dice.choice(others[values.dtype.kind])
    item[...] = values


FORGERIES: list[Callable[[h5py.File, random.Random], None]] = [
    an_attribute,
    an_attribute,
    nothing_there,
    a_link,
    another_array,
    other_values,
]


def forge(path: Path, dice: random.Random) -> str:
    """Forge a file; the name of what was done."""
    with h5py.File(path, "r+") as file:
        forgery = dice.choice(FORGERIES)
        forgery(file, dice)
    return forgery.__name__
