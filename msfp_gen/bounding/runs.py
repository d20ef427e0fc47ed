"""Lower, nominal and upper runs of a scene, and what came of each, side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from msfp_gen.bounding.factors import PROPERTIES, FactorTable
from msfp_gen.characterise import Characterisation, characterise
from msfp_gen.errors import InputError, RunError
from msfp_gen.law_numbers import proportional
from msfp_gen.simulation import simulate

if TYPE_CHECKING:
    from msfp_gen.bearing import Bearing
    from msfp_gen.result import Result
    from msfp_gen.scene import Scene

CASES = ("lower", "nominal", "upper")
Progress = Callable[[str], Callable[[float, float], None] | None]


class Measure(NamedTuple):
    """A quantity that is compared: its unit, which end of it governs a design, and how it is read."""

    unit: str
    governs: Literal["most", "least", ""]
    read: Callable[[Characterisation], float | None]


@dataclass(frozen=True)
class Case:
    """One run: "lower", "nominal" or "upper"; its scene; its result and characterisation, or why it failed.

    Of a run that failed, `result` is what was computed until then, and there is no characterisation.
    """

    name: str
    scene: Scene
    result: Result | None
    found: Characterisation | None
    failure: str = ""


@dataclass(frozen=True)
class Bounds:
    """What `bound` found. lambdas: property -> case -> factor of every surface, bottom first."""

    table: FactorTable
    lambdas: dict[str, dict[str, tuple[float, ...]]]
    cases: tuple[Case, ...]

    @property
    def succeeded(self) -> bool:
        """Whether every run reached its end."""
        return not any(case.failure for case in self.cases)

    @property
    def surfaces(self) -> int:
        """Number of surfaces of the bearing."""
        return len(self.cases[0].scene.bearing.surfaces)

    def quantities(self) -> dict[str, dict[str, float | None]]:
        """Quantity -> case -> value in SI; None where a run failed or the quantity is not defined in it."""
        return {
            name: {case.name: None if case.found is None else measure.read(case.found) for case in self.cases}
            for name, measure in measures(self.surfaces).items()
        }

    def governing(self) -> dict[str, str]:
        """Demand -> the case that is worst for it; left out where a case has no value, or all have the same."""
        worst, kinds = {}, measures(self.surfaces)
        for name, values in self.quantities().items():
            known = {case: value for case, value in values.items() if value is not None}
            if kinds[name].governs and len(known) == len(values) and len(set(known.values())) > 1:
                pick = max if kinds[name].governs == "most" else min
                worst[name] = pick(known, key=known.__getitem__)
        return worst

    def as_dict(self) -> dict[str, Any]:
        """Plain and JSON-able: factors, quantities side by side, what governs, and each characterisation."""
        table = self.table
        return {
            "factors": {"name": table.name, "description": table.description, "source": table.source,
                        "rule": table.rule, "adjustment": table.adjustment, "lambdas": self.lambdas},
            "quantities": self.quantities(),
            "governing": self.governing(),
            "cases": {case.name: {"failure": case.failure, "characterisation": case.found and case.found.as_dict()}
                      for case in self.cases},
        }  # fmt: skip


def bound(scene: Scene, table: FactorTable, *, progress: Progress | None = None) -> Bounds:
    """Run `scene` with its properties at their lower bounds, as they stand, and at their upper bounds.

    `progress` is given the name of each case and gives what `simulate` calls. A case that fails is kept with its
    reason, and the others run all the same. Raises InputError: a factor names a surface the bearing has not, or the
    bearing did not move; RunError only where a person interrupted.
    """
    lambdas = _lambdas(scene.bearing, table)
    cases = []
    for name, bounded in bounded_scenes(scene, table).items():
        report = progress(name) if progress else None
        try:
            result = simulate(bounded, progress=report)
        except RunError as error:
            if error.status == "interrupted":  # who stops one run stops them all
                raise
            kept: Any = error.result
            cases.append(Case(name, bounded, kept, None, str(error)))
        else:
            cases.append(Case(name, bounded, result, characterise(result)))
    return Bounds(table, lambdas, tuple(cases))


def bounded_scenes(scene: Scene, table: FactorTable) -> dict[str, Scene]:
    """Case -> the scene with its properties multiplied; "nominal" is `scene` itself. Raises InputError as `bound`."""
    lambdas, law = _lambdas(scene.bearing, table), scene.law[1]
    if "friction" in lambdas and law is not None and not proportional(law, scene.bearing):
        raise InputError(
            f"effects.friction_law = {law.text!r}: lambda factors multiply `friction`, which this law does not follow "
            "in proportion; give a formula that is mu times the rest"
        )
    scenes = {}
    for case in CASES:
        bearing = scene.bearing
        for named, factors in lambdas.items():
            for column in PROPERTIES[named]:
                bearing = _scaled(bearing, column, factors[case])
        label = f"{scene.name or 'scene'}, {case}"
        scenes[case] = scene if case == "nominal" else replace(scene, bearing=bearing, name=label)
    return scenes


def _scaled(bearing: Bearing, column: str, factors: tuple[float, ...]) -> Bearing:
    """`bearing` with a column of its surfaces multiplied; as it is where the surfaces have no such value."""
    values: list[Any] = [getattr(surface, column, None) for surface in bearing.surfaces]
    if any(value is None for value in values):
        return bearing
    return bearing.replace(**{column: [value * factor for value, factor in zip(values, factors, strict=True)]})


def _lambdas(bearing: Bearing, table: FactorTable) -> dict[str, dict[str, tuple[float, ...]]]:
    """Property -> case -> factor of every surface; one where no factor names it."""
    count = bearing.layout.surfaces
    pairs: dict[str, dict[int, tuple[float, float]]] = {}
    for index, factor in enumerate(table.factors):
        for surface in factor.surfaces or range(1, count + 1):
            if surface > count:
                raise InputError(f"factor[{index}].surfaces has {surface}: this bearing has surfaces 1 to {count}")
            found = pairs.setdefault(factor.property, {})
            if surface in found:
                raise InputError(f"factor[{index}]: {factor.property} of surface {surface} has a factor already; "
                                 "give every property of a surface once")  # fmt: skip
            found[surface] = table.combined(factor)
    ends = {"lower": 0, "upper": 1}
    return {
        named: {case: tuple(found.get(surface, (1.0, 1.0))[ends[case]] if case in ends else 1.0
                            for surface in range(1, count + 1)) for case in CASES}
        for named, found in pairs.items()
    }  # fmt: skip


def measures(surfaces: int) -> dict[str, Measure]:
    """Every quantity that is compared, for a stack of so many surfaces; numbers of cycles are their means."""
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
