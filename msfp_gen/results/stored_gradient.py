"""Reading of the derivatives of a run: a group of its netCDF-4 file (`results/files.py`)."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.results.extremes import Extremes
from msfp_gen.results.gradient import ENERGIES, ERROR, WITH_INTEGRALS, Gradients
from msfp_gen.results.history import LABELS, STACK, quantities
from msfp_gen.scene.parameters import Parameter

if TYPE_CHECKING:
    from msfp_gen.common.arrays import Array
    from msfp_gen.results.stored_group import StoredGroup

GROUP = "gradient"  # group of the file
EVENT_ARRAYS = ("event_time", "event_displacement", "event_top_force")


def from_group(root: StoredGroup, rows: int, surfaces: int, events: int) -> tuple[Gradients, dict[str, Any]]:
    """The derivatives in the group of a file, and its arrays and attributes by name.

    rows, surfaces, events: their number in the run. Raises ValueError where something is not as expected.
    """
    group = root.group(GROUP)
    about = group.attributes(lambda name: name in ("parameters", "extremes", f"extremes{ERROR}"))
    parameters = tuple(_parameter(given) for given in json.loads(str(about["parameters"])))
    count, read = len(parameters), dict[str, Any](about)
    sizes = dict.fromkeys(STACK, surfaces) | {name: len(labels) for name, labels in LABELS.items()}

    def array(name: str, *shape: int) -> Array:
        values: Array = group.array(name, (count, *shape))
        if not np.isfinite(values).all():
            raise ValueError(f"{name} of the gradient is not finite")
        read[name] = values
        return values

    def gradients(suffix: str = "", error: Gradients | None = None) -> Gradients:
        extremes = tuple(Extremes.of_table(given) for given in json.loads(str(about[f"extremes{suffix}"])))
        if len(extremes) != count or not count:
            raise ValueError("the derivatives of the extremes are not those of the parameters")
        derivatives = {}
        for field, quantity in quantities().items():
            names = [name for name in (f"{name}{suffix}" for name in quantity.columns(field)) if name in group]
            if field != "time" and names:
                shape = (rows, *(sizes[dim] for dim in quantity.column_dims))
                derivatives[field] = quantity.joined([array(name, *shape) for name in names])
        energies = WITH_INTEGRALS if "energy_input" in group else ENERGIES
        energy = {name: array(f"energy_{name}{suffix}", rows) for name in energies}
        time, displacement, force = (
            array(f"{name}{suffix}", events, *shape) for name, shape in zip(EVENT_ARRAYS, ((), (3,), (3,)), strict=True)
        )
        return Gradients(parameters, derivatives, energy, time, displacement, force, extremes, error)

    return gradients(error=gradients(ERROR) if f"extremes{ERROR}" in about else None), read


def _parameter(given: dict[str, Any]) -> Parameter:
    parameter = Parameter(**(given | {"index": tuple(given["index"])}))
    if not np.isfinite(parameter.value):
        raise ValueError(f"the value of {parameter.path} is not finite")
    return parameter
