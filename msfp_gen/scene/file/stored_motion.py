"""The motion in a result file: its `[motion]` table, or its polynomials.

A result file must be readable without any other file. A motion that was read from a file or made in Python is
therefore stored as polynomials; its table is kept for information only, with file names instead of paths.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.errors import InputError
from msfp_gen.common.fields import Notes
from msfp_gen.motions.motion import CHANNELS, Motion
from msfp_gen.scene.file.loader import bearing_scene_text
from msfp_gen.scene.file.motion_tables import PolynomialMotion, motion_from

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.scene.scene import Scene

GROUP = "motion"  # group of the netCDF file with the polynomials
PIECES, RECIPE = "pieces", "recipe"  # values of the attribute `motion`: polynomials in `GROUP`, or the table alone
COMPRESSED = ("coefficients",)
UNITS = "m or rad, over s^power"


def scene_attribute(scene: Scene) -> str:
    """The scene as TOML text without the polynomials of its motion and without folders of this machine."""
    table = scene.motion_table
    if not needs_pieces(scene):
        return bearing_scene_text(scene, table)
    informative = table is not None and "file" in table and _makes(table, scene.motion)
    return bearing_scene_text(scene, {**table, **_file_names(table)} if table is not None and informative else {})


def needs_pieces(scene: Scene) -> bool:
    """Whether the table alone cannot make the motion again: it names files, or Python code made the motion."""
    table = scene.motion_table
    if table is None or table["kind"] == PolynomialMotion.kind or table.get("file") is not None:
        return True
    return not _makes(table, scene.motion)


def to_pieces(motion: Motion) -> xr.Dataset:
    """A motion as a dataset: knots [s], coefficients by piece, channel and power of time, jumps [s]."""
    import xarray as xr

    attributes: dict[str, str | float] = {"name": motion.name, "metadata": json.dumps(dict(motion.metadata))}
    if motion.max_step is not None:
        attributes["max_step"] = motion.max_step
    variables = {
        "knots": ("knot", motion.knots, {"units": "s", "long_name": "ends of the pieces"}),
        "coefficients": (
            ("piece", "channel", "power"),
            motion.coefficients,
            {"units": UNITS, "long_name": "coefficients of rising powers of time"},
        ),
        "jumps": ("jump", motion.jumps, {"units": "s", "long_name": "where the acceleration may jump"}),
    }
    return xr.Dataset(variables, {"channel": ("channel", np.array(CHANNELS))}, attributes)


def from_pieces(arrays: Mapping[str, Any], attributes: Mapping[str, Any]) -> Motion:
    """The inverse of `to_pieces`: the motion of its arrays and attributes."""
    step, metadata = attributes.get("max_step"), json.loads(attributes["metadata"])
    try:
        metadata = Notes().parse(metadata)
    except ValueError as error:
        raise InputError(f"motion.metadata: {error}") from None
    step = None if step is None else float(step)
    return Motion(**arrays, max_step=step, name=str(attributes["name"]), metadata=metadata)


def _makes(table: Mapping[str, Any], motion: Motion) -> bool:
    """Whether a `[motion]` table makes this motion; not so where `dataclasses.replace` changed the scene's motion."""
    try:
        return motion_from(table) == motion
    except InputError:  # its file no longer exists
        return False


def _file_names(table: Mapping[str, Any]) -> dict[str, Any]:
    """The key `file` of a `[motion]` table without folders."""
    file = table["file"]
    return {"file": PurePath(file).name if isinstance(file, str) else [PurePath(path).name for path in file]}
