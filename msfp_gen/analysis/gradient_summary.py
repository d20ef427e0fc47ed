"""Derivatives of the scalars of the summary of a run with respect to parameters of its scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.analysis.summary import axial_load
from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError
from msfp_gen.results.dataset import gradients_of
from msfp_gen.results.gradient import ENERGIES, gradients_of_extremes
from msfp_gen.results.history import LABELS

if TYPE_CHECKING:
    from msfp_gen.results.gradient import Gradients
    from msfp_gen.results.run_data import RunData
    from msfp_gen.scene.parameters import Parameter

WITHOUT = {
    "rims_met": "it is a list of surfaces, which jumps where another rim is met",
    "transitions": "they are read from rows",
    "counters": "they count the work of the solver",
    "error": "errors are measured where a slider meets its rim",
    "energy": "its terms are integrals over the run, which simulate(..., energy_gradients=True) differentiates",
}
"""Keys of the summary that have no derivative, or only where it was asked for, with the reason."""


class SummaryGradient(dict[str, Any]):
    """Derivatives of the summary with respect to one parameter; a key without derivative raises InputError."""

    def __missing__(self, key: str) -> Any:
        reason = WITHOUT.get(key, "it is no number that depends on a parameter")
        raise InputError(f"gradient_summary: {key!r} has no derivative: {reason}; give one of {', '.join(self)}")


def summarise_gradients(result: RunData) -> dict[str, dict[str, Any]]:
    """Derivatives of the scalars of `summarise(result)` in SI units, by the path of the parameter.

    Keys: peak_displacement, peak_force, peak_force_ratio, peak_sliding, minimum_gap, minimum_normal_force,
    maximum_normal_force and, with a friction law, least_friction and most_friction, as in the summary; and of runs with
    `energy_gradients` energy, those of the terms of `History.energy` at the end; where errors were measured, error:
    that of each derivative, with the same keys. Raises InputError where the run computed no derivatives, and for a key
    whose value jumps (`WITHOUT`).
    """
    gradients = gradients_of(result)
    recorded = result.recorded_extremes
    assert recorded is not None  # a run that computed derivatives has recorded its extremes
    slopes = gradients_of_extremes(gradients, result.history, recorded)
    gradients_of_summary = dict[str, dict[str, Any]]()
    for i, parameter in enumerate(gradients.parameters):
        own = {name: values[i] for name, values in slopes.items()}
        gradients_of_summary[parameter.path] = _summary(
            gradients, i, own, _ratio_slope(result, parameter, float(own["top_force"][3]))
        )
        if gradients.error is not None:
            own, load = gradients.error.extremes[i].arrays, axial_load(result)
            ratio = float(own["top_force"][3]) / load if load else None
            gradients_of_summary[parameter.path]["error"] = _summary(gradients.error, i, own, ratio)
    return gradients_of_summary


def _summary(gradients: Gradients, index: int, slopes: dict[str, Array], ratio: float | None) -> SummaryGradient:
    names = (*LABELS["axis"], "radial")
    gradient = SummaryGradient(
        peak_displacement=dict(zip(names, slopes["displacement"].tolist(), strict=True)),
        peak_force=dict(zip(names, slopes["top_force"].tolist(), strict=True)),
        peak_force_ratio=ratio,
        peak_sliding=slopes["sliding"].tolist(),
        minimum_gap=slopes["gap"].tolist(),
        minimum_normal_force=slopes["least_normal"].tolist(),
        maximum_normal_force=slopes["most_normal"].tolist(),
    )
    for name in ("least_friction", "most_friction"):
        if name in slopes:
            gradient[name] = slopes[name].tolist()
    energy = {name.removeprefix("energy_"): v for name, v in gradients.arrays.items() if name.startswith("energy_")}
    if set(energy) > set(ENERGIES):
        gradient["energy"] = {name: float(values[index, -1]) for name, values in energy.items()}
    return gradient


def _ratio_slope(result: RunData, parameter: Parameter, slope: float) -> float | None:
    """Derivative of peak radial force over axial load; None without a constant load."""
    load = axial_load(result)
    if not load:
        return None
    peak = float(result.extremes.top_force[3])
    return slope / load - peak * _load_slope(result, parameter) / load**2


def _load_slope(result: RunData, parameter: Parameter) -> float:
    """Derivative of `axial_load` with respect to a parameter."""
    scene, name = result.scene, parameter.path
    gravity, mass = scene.bearing.gravity, float(getattr(scene.top, "mass", 0.0)) if scene.top.kind == "mass" else 0.0
    slopes = {"top.axial_load": 1.0, "top.force[2]": -1.0, "top.mass": gravity, "bearing.gravity": mass}
    if name == "load.scale" and scene.load is not None:
        return -float(np.asarray(scene.load.coefficients)[0, 2, 0])
    return slopes.get(name, 0.0)
