"""Variables of a dataset as data: dimensions, unit, meaning, and the array of a result that each is a part of.

From such a table the dataset of a result is made, its file is read, and the columns of its tables are named.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from types import EllipsisType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.results.stored_group import Attribute, StoredGroup

if TYPE_CHECKING:
    import xarray as xr

Index = tuple[int | slice | EllipsisType, ...]
Arrays = dict[str, Any]
Labels = Mapping[str, Any]  # dimension -> labels of its entries, a sequence or an array
SURFACES = ("bearing", "surface")  # dimensions of values; a bearing with fewer surfaces has fewer values
MEANINGS = {  # of dimensions whose labels do not say it
    "body": "moving body k, base is 1",
    "surface": "sliding surface, bottom first",
    "freedom": "along and about E1, E2, E3",
    "coordinate": "of the building, from 0",
    "bearing": "number of the bearing",
}


class Variable(NamedTuple):
    """A variable of a dataset.

    dims: the first is `time` or `event`. field: the array of a result; part: of it, where it has the dimensions
    `whole`. sign: what a positive value is. kind: type of its values. words: those that a text may be.
    """

    dims: tuple[str, ...]
    unit: str
    meaning: str
    field: str
    part: Index = ()
    whole: tuple[str, ...] = ()
    sign: str = ""
    kind: Any = np.float64
    words: tuple[str, ...] = ()

    @property
    def about(self) -> dict[str, str]:
        """Attributes of the variable in a dataset."""
        about = {"units": self.unit, "long_name": self.meaning, "sign": self.sign}
        return {name: text for name, text in about.items() if text}

    def of(self, arrays: Mapping[str, Any]) -> Array:
        """Values of the variable, of the shape of `dims` [unit of the variable]. arrays: of a result, by field."""
        values: Array = arrays[self.field][self.part or ...]
        return values


Variables = Mapping[str, Variable]
Places = dict[str, tuple[Variable, Any]]  # column of a table -> its variable, and its index after time


def dataset_of(
    variables: Variables, arrays: Mapping[str, Any], coordinates: Arrays, attributes: Mapping[str, Attribute]
) -> xr.Dataset:
    """The dataset of these variables; those without an array are left out. coordinates: see `label_coordinates`."""
    import xarray as xr

    data = {name: (v.dims, v.of(arrays), v.about) for name, v in variables.items() if v.field in arrays}
    return xr.Dataset(data, coordinates, attributes)


def label_coordinates(labels: Labels) -> Arrays:
    """The coordinates of labelled dimensions."""
    about = {dim: {"long_name": MEANINGS[dim]} if dim in MEANINGS else {} for dim in labels}
    return {dim: (dim, np.array(x, None if len(x) else str), about[dim]) for dim, x in labels.items()}


def stored_fields(
    group: StoredGroup,
    variables: Variables,
    sizes: Mapping[str, int],
    missing: Any = None,
) -> Arrays:
    """The arrays of a result by field, from the variables in a group of its file. Raises ValueError: not as expected.

    sizes: of the dimensions. missing: True where a bearing has no such surface, and the values are NaN.
    """
    fields: Arrays = {}
    for name, variable in variables.items():
        shape = tuple(sizes[dim] for dim in variable.dims)
        if variable.words:
            values = np.array(group.texts(name, shape[0], variable.words), dtype="O")
        else:  # the time gives the number of rows
            values = group.array(name, shape, variable.kind, compressed=name != "time")
            unknown = missing is not None and variable.dims[1:] == SURFACES
            if not (np.isfinite(values) | (missing if unknown else False)).all():
                raise ValueError(f"{name} is not finite")
        if variable.part and variable.field not in fields:
            fields[variable.field] = np.empty([sizes[dim] for dim in variable.whole])
        if variable.part:
            fields[variable.field][variable.part] = values
        else:
            fields[variable.field] = values
    return fields


def columns_of(name: str, dims: Iterable[str], labels: Labels) -> Iterator[tuple[str, Any]]:
    """The columns of a variable in a table, and their indices: `displacement_E1`, `sliding_2`, `tilt_3_psi`.

    dims: after time. Blanks in labels are underscores.
    """
    chosen = [labels[dim] for dim in dims]
    for index in np.ndindex(*map(len, chosen)):
        shown = (str(entries[i]) for entries, i in zip(chosen, index, strict=True))
        yield "_".join([name, *shown]).replace(" ", "_"), index


def column_places(variables: Variables, labels: Labels) -> Places:
    """The columns of a table of all rows."""
    return {
        column: (variable, index)
        for name, variable in variables.items()
        if variable.dims[0] == "time"
        for column, index in columns_of(name, variable.dims[1:], labels)
    }


def digest_of_names(names: Iterable[Any]) -> str:
    """A digest of the names that a file of this version has."""
    return sha256(json.dumps(list(names)).encode()).hexdigest()[:12]
