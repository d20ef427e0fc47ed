"""Files of the result of a building: netCDF, CSV, Parquet, MATLAB."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from msfp_gen.buildings.columns import table
from msfp_gen.buildings.dataset import attributes, stored, to_dataset
from msfp_gen.buildings.text import GROUP, ground_name, to_arrays
from msfp_gen.common.output import DATASET_SUFFIXES, check_output
from msfp_gen.results import export
from msfp_gen.results.netcdf import write_groups
from msfp_gen.results.reading import DIGEST
from msfp_gen.results.stored_group import ArrayDigest, digest
from msfp_gen.scene.file.stored_motion import to_pieces

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.buildings.data import BuildingData

PEAKS = "peaks"  # group
DIGESTED = (
    "scene",
    "status",
    "message",
    "counts",
    "monitored",
    "provenance",
)  # attributes that the digest of a file covers


def save(result: BuildingData, path: str | Path) -> Path:
    """Write in the format of the suffix: .nc, .parquet, .csv or .mat; completely or not at all. Raises InputError."""
    target = export.check_result_path(path)
    return WRITERS[target.suffix.lower()](result, target)


def export_columns(result: BuildingData, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write some columns as CSV or Parquet, time first: `axial_force_3`, or whole variables (`drift`); None: all.

    Raises InputError for another name or an invalid path.
    """
    target = check_output(path, export.TABLE_WRITERS, "output")
    return {".csv": write_csv, ".parquet": write_parquet}[target.suffix.lower()](result, target, names)


def write_netcdf(result: BuildingData, path: str | Path) -> Path:
    """Write rows, derived rows and scene as netCDF-4 file. Raises InputError for an invalid path."""
    path = check_output(path, DATASET_SUFFIXES)
    dataset = to_dataset(result)
    groups = {GROUP: to_arrays(result.scene.building)}
    groups |= {ground_name(i): to_pieces(motion) for i, motion in enumerate(result.scene.grounds[0])}
    if result.recorded_peaks is not None:
        groups[PEAKS] = result.recorded_peaks.to_arrays()
    dataset.attrs[DIGEST] = digest_of(result, groups)
    write_groups(path, dataset, groups)
    return path


def digest_of(result: BuildingData, groups: dict[str, xr.Dataset]) -> str:
    """The digest of the values from which a result is read."""
    about = {name: value for name, value in attributes(result).items() if name in DIGESTED}
    arrays = {name: ArrayDigest.of(variable.values) for name, variable in stored(result).items()}
    arrays["time"] = ArrayDigest.of(result.time)
    for group, values in groups.items():
        arrays |= {f"{group}/{name}": ArrayDigest.of(value.to_numpy()) for name, value in values.data_vars.items()}
    return digest(about, arrays)


def write_csv(result: BuildingData, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write a CSV file as `Result.to_csv` does; columns of surfaces that a bearing does not have are left out."""
    target = check_output(path, (".csv",))
    dataset = to_dataset(result)
    title = f"{result.scene.name or 'unnamed building'}, status {result.status}; u = base - top"
    export.write_csv_table(target, table(dataset, names), title, _origin(dataset))
    return target


def write_parquet(result: BuildingData, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write a Parquet file as `Result.to_parquet` does."""
    target = export.check_result_path(check_output(path, (".parquet",)))
    dataset = to_dataset(result)
    about = {str(key): str(value) for key, value in dataset.attrs.items()}
    export.write_parquet_table(target, table(dataset, names), about)
    return target


def write_mat(result: BuildingData, path: str | Path) -> Path:
    """Write a MATLAB file as `Result.to_mat` does."""
    target = check_output(path, (".mat",))
    export.write_mat_dataset(target, to_dataset(result))
    return target


def _origin(dataset: xr.Dataset) -> list[str]:
    about = dict(dataset.attrs)
    scene = str(about.pop("scene")).splitlines()
    return [*(f"{key}: {' '.join(str(value).split())}" for key, value in about.items()), "scene:", *scene]


WRITERS: dict[str, Callable[[BuildingData, str | Path], Path]] = {
    ".nc": write_netcdf,
    ".parquet": write_parquet,
    ".csv": write_csv,
    ".mat": write_mat,
}
