"""The motion of a result file: a recipe where that is enough, the polynomials themselves where it is not.

A result must read back where the files of its motion are not, so a motion that was read from a file or made in Python
is stored whole. The text of the scene then keeps the recipe for people, with the names of its files alone.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.motion import CHANNELS, Motion
from msfp_gen.motion_tables import KINDS, Pieces
from msfp_gen.scenefile import scene_text

if TYPE_CHECKING:
    import xarray as xr

    from msfp_gen.scene import Scene

GROUP = "motion"  # of the netCDF file
PIECES, RECIPE = "pieces", "recipe"  # how a file keeps the motion
COMPRESSED = {"coefficients": {"zlib": True, "complevel": 1}}
UNITS = "m or rad, over s^power"


def recipe(scene: Scene) -> str:
    """The scene as TOML without the polynomials of its motion and without folders of this machine."""
    table = scene.motion_table
    if not needs_pieces(scene):
        return scene_text(scene, table)
    readable = table is not None and "file" in table and _makes(table, scene.motion)
    return scene_text(scene, {**table, **_names(table)} if table is not None and readable else {})


def needs_pieces(scene: Scene) -> bool:
    """Whether the motion needs more than the package to be made again: files, or the Python that made it."""
    table = scene.motion_table
    if table is None or table["kind"] == Pieces.kind or table.get("file") is not None:
        return True
    return not _makes(table, scene.motion)


def to_pieces(motion: Motion) -> xr.Dataset:
    """A motion as a dataset: knots [s], coefficients by piece, channel and power, jumps [s]."""
    import xarray as xr

    attributes: dict[str, str | float] = {"name": motion.name, "metadata": json.dumps(dict(motion.metadata))}
    if motion.max_step is not None:
        attributes["max_step"] = motion.max_step
    variables = {
        "knots": ("knot", motion.knots, {"units": "s", "long_name": "ends of the pieces"}),
        "coefficients": (
            ("piece", "channel", "power"), motion.coefficients, {"units": UNITS, "long_name": "rising powers of time"}
        ),
        "jumps": ("jump", motion.jumps, {"units": "s", "long_name": "where the acceleration may jump"}),
    }  # fmt: skip
    return xr.Dataset(variables, {"channel": ("channel", np.array(CHANNELS))}, attributes)


def from_pieces(dataset: xr.Dataset) -> dict[str, Any]:
    """The inverse of `to_pieces`, as the `[motion]` table of a scene."""
    attributes = dataset.attrs
    step = attributes.get("max_step")
    arrays = {name: dataset[name].to_numpy() for name in ("knots", "coefficients", "jumps")}
    return Pieces.of(
        Motion(**arrays, max_step=None if step is None else float(step), name=str(attributes["name"]),
               metadata=json.loads(attributes["metadata"]))
    )  # fmt: skip


def _makes(table: Mapping[str, Any], motion: Motion) -> bool:
    """Whether a recipe makes this motion, of which `dataclasses.replace` may have put another in its place."""
    try:
        return KINDS[table["kind"]](**{key: value for key, value in table.items() if key != "kind"}).build() == motion
    except InputError:  # a file that is gone since
        return False


def _names(table: Mapping[str, Any]) -> dict[str, Any]:
    """The `file` of a recipe without its folders."""
    file = table["file"]
    return {"file": PurePath(file).name if isinstance(file, str) else [PurePath(each).name for each in file]}
