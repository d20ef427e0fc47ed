"""The rows of a building as columns, one for each component: `axial_force_3`, `node_acceleration_floor_2_u1`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from msfp_gen.buildings.data import BuildingData
from msfp_gen.buildings.dataset import to_dataset
from msfp_gen.buildings.scene import BuildingScene
from msfp_gen.common.arrays import Array
from msfp_gen.results import export

if TYPE_CHECKING:
    import xarray as xr


def table(dataset: xr.Dataset, names: Sequence[str] | None = None) -> list[export.Column]:
    """The columns of an exported file, time first: those of these names, or of these variables; None: all.

    Blanks in names of nodes and storeys are underscores. Surfaces that a bearing does not have are left out. Raises
    InputError for another name.
    """
    named = [each._replace(name=each.name.replace(" ", "_")) for each in export.columns(dataset)]
    return [
        each
        for each in export.selected_columns(named, names)
        if not each.values.size or each.values[0] == each.values[0]
    ]


def columns_of(result: BuildingData) -> dict[str, Array]:
    """Name -> values of every column, shape (k,), SI units."""
    return {each.name: each.values for each in table(to_dataset(result))}


def column_names(scene: BuildingScene) -> tuple[str, ...]:
    """Names of the columns that a run of the scene has."""
    return tuple(columns_of(_at_rest(scene)))


def _at_rest(scene: BuildingScene) -> BuildingData:
    """One row of a building that does not move, and its bearings carry nothing."""
    coordinates, bearings = len(scene.building.mass), len(scene.bearings)
    surfaces = [np.zeros((1, len(each.bearing.surfaces))) for each in scene.bearings]
    still, energy = np.zeros((1, coordinates)), np.zeros(1)
    return BuildingData(
        scene=scene,
        time=np.zeros(1),
        displacement=still,
        velocity=still,
        acceleration=still,
        ground=np.zeros((1, 3, 3)),
        wrench=np.zeros((1, bearings, 2, 6)),
        normal_force=surfaces,
        sliding=surfaces,
        dissipated=np.zeros((1, bearings)),
        stored=np.zeros((1, bearings)),
        damped=energy,
        received=energy,
        input=energy,
        support=np.zeros((1, bearings, 3, 3)),
        counts={},
    )
