"""The netCDF-4 file of a result: its dataset, and in groups the polynomials of its motion and its derivatives."""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping
from dataclasses import asdict
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msfp_gen.common.output import DATASET_SUFFIXES, check_output, write_bytes
from msfp_gen.results import stored_gradient
from msfp_gen.results.dataset import to_dataset
from msfp_gen.results.gradient import Gradients
from msfp_gen.results.gradient_dataset import to_gradient_dataset
from msfp_gen.results.reading import DIGEST, digest_of
from msfp_gen.results.run_data import RunData
from msfp_gen.results.stored_group import ArrayDigest, seal

if TYPE_CHECKING:
    import xarray as xr


def write_netcdf(result: RunData, path: str | Path) -> Path:
    """Write the dataset of `result` to `path`, completely or not at all. Raises InputError for an invalid path."""
    from msfp_gen.scene.file.stored_motion import GROUP, PIECES, to_pieces

    path = check_output(path, DATASET_SUFFIXES)
    dataset = to_dataset(result)
    pieces = to_pieces(result.scene.motion) if dataset.attrs["motion"] == PIECES else None
    gradient = None if result.gradients is None else gradient_group(result, result.gradients)
    groups = {name: each for name, each in ((GROUP, pieces), (stored_gradient.GROUP, gradient)) if each is not None}
    dataset.attrs[DIGEST] = digest_of_dataset(dataset, groups)
    write_groups(path, dataset, groups)
    return path


def write_groups(path: Path, dataset: xr.Dataset, groups: Mapping[str, xr.Dataset]) -> None:
    """Write a dataset, and others as groups, as one sealed netCDF-4 file, completely or not at all."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    # The file is made in memory, because HDF5 crashes instead of raising an error when the disk is full.
    content = BytesIO()
    with h5netcdf.File(content, "w") as file:
        dataset.dump_to_store(H5NetCDFStore(file), encoding=compressed_rows(dataset))
        for name, each in groups.items():
            each.dump_to_store(H5NetCDFStore(file, group=name), encoding=_encoding(each))
    write_bytes(path, [content.getbuffer(), seal(sha256(content.getbuffer()))])


def _encoding(group: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    """Of a group: of rows, or of the pieces of a motion."""
    from msfp_gen.scene.file.stored_motion import COMPRESSED

    return compressed_rows(group) | {name: each for name, each in COMPRESSED.items() if name in group}


def compressed_rows(dataset: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    """The encoding of the variables along the time.

    The lowest compression level suffices: histories of stuck surfaces and of rims repeat most values.
    """
    return {
        name: {"zlib": True, "complevel": 1}
        for name, variable in dataset.data_vars.items()
        if "time" in variable.dims and variable.size
    }


def digest_of_dataset(
    dataset: xr.Dataset, groups: Mapping[str, xr.Dataset], rows: Mapping[str, ArrayDigest] | None = None
) -> str:
    """The digest of the values that `read_result` reads, also in groups of the file by name.

    rows: of what was written in blocks, instead of `dataset`.
    """
    arrays: dict[str, Any] = {str(name): variable.to_numpy() for name, variable in dataset.data_vars.items()}
    arrays["time"] = dataset["time"].to_numpy()
    about = dict(dataset.attrs)
    arrays |= rows or {}
    for group, each in groups.items():
        arrays |= {f"{group}/{name}": variable.to_numpy() for name, variable in each.data_vars.items()}
        about |= {f"{group}/{name}": value for name, value in each.attrs.items()}
    return digest_of(about, arrays)


def gradient_group(result: RunData, gradients: Gradients) -> xr.Dataset:
    """The derivatives of a run, with its parameters and the derivatives of the extremes as attributes."""
    dataset = to_gradient_dataset(result)
    dataset.attrs["parameters"] = json.dumps([asdict(parameter) for parameter in gradients.parameters])
    dataset.attrs["extremes"] = json.dumps([each.table for each in gradients.extremes])
    if gradients.error is not None:
        dataset.attrs["extremes_error"] = json.dumps([each.table for each in gradients.error.extremes])
    return dataset
