"""Derivatives of a run as an xarray.Dataset, and of its summary as plain data."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.errors import InputError
from msfp_gen.results.dataset import coordinates_of, named_columns
from msfp_gen.results.gradient import ERROR, Gradients
from msfp_gen.results.history import ENERGY
from msfp_gen.results.run_data import RunData

if TYPE_CHECKING:
    import xarray as xr

PARAMETER = "parameter"
Variables = Iterator[tuple[str, tuple[tuple[str, ...], Any, dict[str, str]]]]


def gradients_of(result: RunData) -> Gradients:
    """The derivatives of a run. Raises InputError where none were asked for."""
    if result.gradients is None:
        raise InputError("gradient: this run computed none; call simulate(scene, gradients=[path, ...])")
    return result.gradients


def to_gradient_dataset(result: RunData) -> xr.Dataset:
    """Derivatives of the variables of the dataset of a run, under their names, with the first dimension `parameter`.

    Where the errors of the derivatives were measured, each has a variable `..._error` beside it.
    Attributes of a variable: `units`, those of the quantity over `parameter_unit`, which differs between parameters;
    coordinate `parameter_unit`: unit of each parameter; `parameter_value`: its value in the scene.
    """
    import xarray as xr

    gradients = gradients_of(result)
    about = (("path", "", str), ("unit", "_unit", str), ("value", "_value", float))
    coordinates: dict[str, Any] = {
        f"{PARAMETER}{suffix}": (PARAMETER, np.array([getattr(p, name) for p in gradients.parameters], kind))
        for name, suffix, kind in about
    }
    variables = dict(_variables(gradients))
    if gradients.error is not None:
        for name, (dims, values, meaning) in _variables(gradients.error):
            variables[f"{name}{ERROR}"] = (
                dims,
                values,
                meaning | {"long_name": f"error of the {meaning['long_name']}"},
            )
    return xr.Dataset(variables, coordinates_of(result.history.time, result.history.surfaces) | coordinates)


def _variables(gradients: Gradients) -> Variables:
    yield from _rows(gradients)
    yield from _energies(gradients)
    yield from _events(gradients)


def _derivative(unit: str, meaning: str) -> dict[str, str]:
    return {"units": f"{unit}/parameter_unit", "long_name": f"derivative of: {meaning}"}


def _rows(gradients: Gradients) -> Variables:
    for field, values in gradients.rows.items():
        for name, (dims, array, about) in named_columns(field, values):
            yield name, ((PARAMETER, *dims), array, _derivative(about["units"], about["long_name"]))


def _energies(gradients: Gradients) -> Variables:
    for name, values in gradients.energy.items():
        yield f"energy_{name}", ((PARAMETER, "time"), values, _derivative("J", ENERGY[name]))


def _events(gradients: Gradients) -> Variables:
    columns = {
        "event_time": ((), gradients.event_time, "s", "time of the event"),
        "event_displacement": (("axis",), gradients.event_displacement, "m", "displacement u then"),
        "event_top_force": (("axis",), gradients.event_top_force, "N", "F_top then"),
    }
    for name, (dims, values, unit, meaning) in columns.items():
        yield name, ((PARAMETER, "event", *dims), values, _derivative(unit, meaning))


def gradient_group(result: RunData) -> xr.Dataset:
    """The derivatives of a run, with its parameters and the derivatives of the extremes as attributes."""
    gradients, dataset = gradients_of(result), to_gradient_dataset(result)
    dataset.attrs["parameters"] = json.dumps([asdict(parameter) for parameter in gradients.parameters])
    dataset.attrs["extremes"] = json.dumps([extremes.table for extremes in gradients.extremes])
    if gradients.error is not None:
        dataset.attrs["extremes_error"] = json.dumps([extremes.table for extremes in gradients.error.extremes])
    return dataset
