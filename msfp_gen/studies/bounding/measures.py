"""The quantities that a bounding analysis compares, of one bearing and of a building."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from msfp_gen.scene.scene import Scene

if TYPE_CHECKING:
    from msfp_gen.analysis.characterise import Characterisation
    from msfp_gen.buildings.load import AnyScene


class Measure(NamedTuple):
    """A quantity that is compared.

    Attributes:
        unit: SI unit.
        governs: whether its largest or its least value governs a design; "" if neither does.
        read: its value from a characterisation; None if it is not defined.
    """

    unit: str
    governs: Literal["most", "least", ""]
    read: Callable[[Any], float | None]


def measures_of(scene: AnyScene) -> dict[str, Measure]:
    """The quantities that are compared for a scene."""
    return measures(len(scene.bearing.surfaces)) if isinstance(scene, Scene) else building_measures()


def building_measures() -> dict[str, Measure]:
    """Name -> quantity that is compared for a building on bearings."""
    return {
        "peak_displacement": Measure("m", "most", lambda found: max(each.peak_displacement for each in found.bearings)),
        "peak_base_shear": Measure("N", "most", lambda found: found.peak_force),
        "peak_floor_acceleration": Measure("m/s^2", "most", lambda found: found.peak_floor_acceleration),
        "peak_drift_ratio": Measure("1", "most", lambda found: found.peak_drift_ratio),
        "minimum_load_ratio": Measure("1", "least", lambda found: min(e.minimum_load_ratio for e in found.bearings)),
        "maximum_load_ratio": Measure("1", "most", lambda found: max(e.maximum_load_ratio for e in found.bearings)),
        "capacity_left": Measure("m", "least", lambda found: min(each.capacity_left for each in found.bearings)),
        "secant_stiffness": Measure("N/m", "", lambda found: found.secant_stiffness),
        "secant_period": Measure("s", "", lambda found: found.secant_period),
        "residual_displacement": Measure(
            "m", "most", lambda found: found.residual_displacement if found.at_rest else None
        ),
        "energy_dissipated": Measure("J", "", lambda found: found.energy_dissipated),
    }


def measures(surfaces: int) -> dict[str, Measure]:
    """Name -> quantity that is compared, for a stack with this number of surfaces; loop properties are cycle means."""
    whole = {
        "peak_displacement": Measure("m", "most", lambda found: found.peak_displacement),
        "peak_force": Measure("N", "most", lambda found: found.peak_force),
        "secant_stiffness": Measure("N/m", "", lambda found: found.secant_stiffness),
        "effective_stiffness": Measure("N/m", "", _mean("effective_stiffness")),
        "effective_period": Measure("s", "", _mean("effective_period")),
        "energy_dissipated": Measure("J", "", _mean("energy_dissipated")),
        "effective_damping": Measure("1", "", _mean("effective_damping")),
        "zero_displacement_force": Measure("N", "", _mean("zero_displacement_force")),
        "residual_displacement": Measure(
            "m", "most", lambda found: found.residual_displacement if found.at_rest else None
        ),
        "maximum_uplift": Measure("m", "most", lambda found: found.maximum_uplift),
    }
    kinds: dict[str, tuple[str, Literal["most", "least"]]] = {
        "capacity_left": ("m", "least"),
        "peak_velocity": ("m/s", "most"),
        "peak_heat_flux": ("W/m^2", "most"),
    }
    each = {
        f"{name}_{surface}": Measure(unit, governs, _of_surface(name, surface))
        for name, (unit, governs) in kinds.items()
        for surface in range(1, surfaces + 1)
    }
    return whole | each


def _mean(name: str) -> Callable[[Characterisation], float | None]:
    return lambda found: found.envelope[name].mean if name in found.envelope else None


def _of_surface(name: str, surface: int) -> Callable[[Characterisation], float | None]:
    return lambda found: getattr(found.surfaces[surface - 1], name)
