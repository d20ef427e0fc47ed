"""Runs of a scene at lower bound, nominal and upper bound of its properties, and their comparison.

A scene and a table of factors come in; `bound` runs the three cases in a batch; quantities by case go out, as tables,
CSV and a figure of the loops.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.aliases import Progress
from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError, RunError
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.figures.bearing import axes_along
from msfp_gen.figures.style import (
    CASE_COLOURS,
    THIN,
    displacement,
    displacement_label,
    engineering,
    force,
    headline,
    page,
    subscript,
)
from msfp_gen.results.characterise import Characterisation
from msfp_gen.results.quantities import ColumnSource, quantities
from msfp_gen.results.sign import shown_sign
from msfp_gen.scene.fidelity import check_stack
from msfp_gen.scene.friction_parameters import proportional
from msfp_gen.scene.plausibility import require_meant
from msfp_gen.specification.friction_laws import Law
from msfp_gen.studies.batch import ENDED, completed_runs
from msfp_gen.studies.bounding.factors import PROPERTIES, RULES, SHEET, FactorTable, load_factors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.system import System

CASES = ("lower", "nominal", "upper")


@dataclass(frozen=True)
class Case:
    """One run of a bounding analysis.

    Attributes:
        name: one of CASES.
        scene: with the properties multiplied.
        result: of the run; if the run failed, with the rows until then, or None without rows.
        characterisation: of the run; None if the run failed.
        failure: message of the run that failed, else "".
    """

    name: str
    scene: System
    result: Any
    characterisation: Characterisation | None
    failure: str = ""

    def value(self, source: ColumnSource) -> float | None:
        """The value of a quantity [SI]; None where the run failed or the quantity is undefined."""
        if self.result is None or self.characterisation is None:
            return None
        return source.value(self.result.entry, self.characterisation)  # type: ignore[no-any-return]

    def place(self, source: ColumnSource) -> str:
        """Where the value of a quantity is, and its share of what is allowed there; "" where it names no place."""
        where = source.quantity.where
        return str(getattr(self.characterisation, where)) if where and self.characterisation is not None else ""

    @property
    def stopped_at(self) -> float | None:
        """Time at which the run met the stop condition of its scene [s]; None if it did not."""
        return None if self.result is None else self.result.verdict.stopped

    @property
    def verdict(self) -> str:
        """The verdict of the run as text."""
        return "the run failed" if self.result is None else self.result.verdict.text


@dataclass(frozen=True)
class Bounds:
    """Result of `bound`.

    Attributes:
        table: of factors.
        lambdas: property -> case -> factor of every surface, bottom first [-].
        cases: in the order of CASES.
    """

    table: FactorTable
    lambdas: dict[str, dict[str, tuple[float, ...]]]
    cases: tuple[Case, ...]

    @property
    def succeeded(self) -> bool:
        """Whether every run reached its end."""
        return not any(case.failure for case in self.cases)

    @property
    def bearing(self) -> Bearing:
        """The nominal bearing; of a building the bearing with the most surfaces."""
        return _typical(next(case for case in self.cases if case.name == "nominal").scene)

    @property
    def compared(self) -> dict[str, ColumnSource]:
        """Column -> quantity that the cases are compared by; properties of loops are means over the cycles."""
        return {name: source for name, source in quantities(self.cases[0].scene).items() if source.compared}

    def quantities(self) -> dict[str, dict[str, float | None]]:
        """Quantity -> case -> value [SI]; None where the run failed or the quantity is undefined."""
        return {name: {case.name: case.value(source) for case in self.cases} for name, source in self.compared.items()}

    def places(self) -> dict[str, dict[str, str]]:
        """Quantity -> case -> where its value is, of those that name a place in some case."""
        places = {
            name: {case.name: case.place(source) for case in self.cases} for name, source in self.compared.items()
        }
        return {name: texts for name, texts in places.items() if any(texts.values())}

    def undefined(self) -> dict[str, str]:
        """Quantity -> cases without a value and the reason, where it is known, as text."""
        reasons = {
            name: {case.name: reason for case in self.cases if (reason := source.reason(case.characterisation))}
            for name, source in self.compared.items()
        }
        return {name: f"{', '.join(cases)}: {next(iter(cases.values()))}" for name, cases in reasons.items() if cases}

    def verdicts(self) -> dict[str, str]:
        """Case -> the verdict of its run."""
        return {case.name: case.verdict for case in self.cases}

    def governing(self) -> dict[str, str]:
        """Quantity -> the case that governs; without quantities where a case has no value, or all values are equal.

        Peaks of a case that met its stop condition, which others did not, are peaks until then: none of these governs.
        """
        governing = {}
        stopped = {case.name for case in self.cases if case.stopped_at is not None}
        for name, values in self.quantities().items():
            known = {case: value for case, value in values.items() if value is not None}
            governs = self.compared[name].quantity.governs
            if governs and len(known) == len(values) and len(set(known.values())) > 1:
                extreme = max if governs == "most" else min
                worst = extreme(known, key=known.__getitem__)
                if worst in stopped or len(stopped) in (0, len(self.cases)):
                    governing[name] = worst
        return governing

    def as_dict(self) -> dict[str, Any]:
        """Plain data, ready for JSON: factors, quantities by case, governing cases, and each characterisation."""
        fields = ("name", "description", "source", "rule", "adjustment")
        return {
            "factors": {**{name: getattr(self.table, name) for name in fields}, "lambdas": self.lambdas},
            "quantities": self.quantities(),
            "places": self.places(),
            "governing": self.governing(),
            "undefined": self.undefined(),
            "cases": {
                case.name: {
                    "failure": case.failure,
                    "stopped_at": case.stopped_at,
                    "verdict": None if case.result is None else case.result.verdict.as_dict,
                    "characterisation": case.characterisation and case.characterisation.as_dict(),
                }
                for case in self.cases
            },
        }


def factors_of(scene: System) -> FactorTable:
    """The bounds that the bearings of a scene have, or the factors of ASCE 7 where one has none."""
    has = all(bearing.friction_lower and bearing.friction_upper for bearing in scene.every_bearing)
    return SHEET if has else load_factors("asce7")


def bound(
    scene: System, table: FactorTable = SHEET, *, force: bool = False, progress: Progress | None = None
) -> Bounds:
    """Run a scene with the properties of its bearings at lower bound, nominal value and upper bound.

    A case that fails is part of the result, and the other cases are run. All cases have the same effects: where `Auto`
    ends with different models, all cases run again with every effect that any of them needs.

    table: of property modification factors; without it the lower and upper friction of the bearing itself. force:
    whether to run also with values that are implausible in any unit. progress: called with the share of the runs that
    is done, and 1. Raises InputError: a bearing without bounds, a factor of a surface that the bearing does not have, a
    pendulum that is "equivalent" to a stack, or a bearing that does not move; RunError: no case has rows.
    """
    require_meant(scene, force=force)
    cases = _cases(scene, table, progress)
    models = [case.result.provenance.get("model", "").split(", then ")[-1] for case in cases if case.result is not None]
    if (wider := scene.with_effects_of(models)) is not None:
        cases = _cases(wider, table, progress)
    return Bounds(table, _lambdas(_typical(scene), table), tuple(cases))


def _cases(scene: System, table: FactorTable, progress: Progress | None) -> list[Case]:
    """Run the cases of a scene at the same time. Raises RunError where no case has rows."""
    scenes = bounded_scenes(scene, table)
    with closing(completed_runs(list(scenes.values()), labels=list(scenes), progress=progress)) as runs:
        results = dict(runs)
    if all(isinstance(result, RunError) for result in results.values()):
        raise results[0]
    return [_case(name, scene, results[index]) for index, (name, scene) in enumerate(scenes.items())]


def _case(name: str, scene: System, result: Any) -> Case:
    if isinstance(result, RunError):
        return Case(name, scene, None, None, str(result).removeprefix(f"{name}: "))
    if result.status in ENDED:
        return Case(name, scene, result, result.characterise())
    return Case(name, scene, result, None, result.message)


def bounded_scenes(scene: System, table: FactorTable) -> dict[str, System]:
    """Case -> the scene with its properties multiplied; "nominal" is `scene` itself.

    All begin with the same effects, the nominal case included. Raises InputError as `bound`.
    """
    scenes = {case: bounded_scene(scene, table, case) for case in CASES}
    return {case: bounded.beginning_like(list(scenes.values())) for case, bounded in scenes.items()}


def bounded_scene(scene: System, table: FactorTable, case: str) -> System:
    """The scene of one case of CASES. Raises InputError as `bound`."""
    check_stack(scene)
    bounded = scene.with_bearings(partial(_bounded_bearing, table=table, case=case))
    return scene if case == "nominal" else replace(bounded, name=f"{scene.name or 'scene'}, {case}")


def _bounded_bearing(bearing: Bearing, law: Law | None, *, table: FactorTable, case: str) -> Bearing:
    """The bearing with its properties multiplied. law: its friction law. Raises InputError."""
    lambdas = _lambdas(bearing, table)
    if "friction" in lambdas and law is not None and not proportional(law, bearing):
        raise InputError(
            f"effects.friction_law = {law.text!r}: lambda factors multiply `friction`, to which this formula is not "
            "proportional; give a formula of the form mu * (...)"
        )
    for name, factors in lambdas.items():
        if name == "friction":
            bearing = _with_friction(bearing, factors[case])
        else:
            for field in PROPERTIES[name]:
                bearing = _scaled(bearing, field, factors[case])
    return bearing


def _with_friction(bearing: Bearing, factors: tuple[float, ...]) -> Bearing:
    """The bearing with its coefficients multiplied where the scene gives them, at the surfaces or at the pivot."""
    # A second coefficient of a friction law takes the factor of the first, so that the law is multiplied as a whole.
    if bearing.friction_given_at == "pivot":
        sheet = [mu * factor for mu, factor in zip(given_friction(bearing), factors, strict=True)]
        changed = bearing.replace(friction=sheet, friction_at="pivot")
        pairs = zip(changed.surfaces, bearing.surfaces, strict=True)
        factors = tuple(new.friction / old.friction if old.friction else 1.0 for new, old in pairs)
    else:
        changed = _scaled(bearing, "friction", factors)
    for field in PROPERTIES["friction"][1:]:
        changed = _scaled(changed, field, factors)
    return changed


def given_friction(bearing: Bearing) -> tuple[float, ...]:
    """The coefficients of friction where they were given, at the pivot or at the surfaces, bottom first [-]."""
    sheet = bearing.friction_at_pivot
    if bearing.friction_given_at == "pivot" and sheet is not None:
        return sheet
    return tuple(surface.friction for surface in bearing.surfaces)


def _typical(scene: System) -> Bearing:
    """The bearing of a scene; of a building the bearing with the most surfaces."""
    return max(scene.every_bearing, key=lambda bearing: len(bearing.surfaces))


def _scaled(bearing: Bearing, field: str, factors: tuple[float, ...]) -> Bearing:
    """The bearing with a field of its surfaces multiplied by `factors`; unchanged if a surface has no such value."""
    values: list[Any] = [getattr(surface, field) for surface in bearing.surfaces]
    if any(value is None for value in values):
        return bearing
    return bearing.replace(**{field: [value * factor for value, factor in zip(values, factors, strict=True)]})


def _lambdas(bearing: Bearing, table: FactorTable) -> dict[str, dict[str, tuple[float, ...]]]:
    """Property -> case -> factor of every surface [-]; 1 for a surface without a factor. Raises InputError."""
    count = bearing.layout.surfaces
    if table == SHEET:  # equal, not the same: a worker process has a copy
        return {"friction": dict(zip(CASES, _sheet_ratios(bearing), strict=True))}
    pairs: dict[str, dict[int, tuple[float, float]]] = {}
    for index, factor in enumerate(table.factors):
        for surface in factor.surfaces or range(1, count + 1):
            if surface > count:
                raise InputError(f"factor[{index}].surfaces has {surface}: this bearing has surfaces 1 to {count}")
            of_surfaces = pairs.setdefault(factor.property, {})
            if surface in of_surfaces:
                raise InputError(
                    f"factor[{index}]: {factor.property} of surface {surface} has a factor already; "
                    "give one factor for each property of a surface"
                )
            of_surfaces[surface] = table.combined(factor)
    lambdas = {}
    for name, of_surfaces in pairs.items():
        lower, upper = zip(*(of_surfaces.get(surface, (1.0, 1.0)) for surface in range(1, count + 1)), strict=True)
        lambdas[name] = {"lower": lower, "nominal": (1.0,) * count, "upper": upper}
    return lambdas


def _sheet_ratios(bearing: Bearing) -> tuple[tuple[float, ...], ...]:
    """Lower, nominal and upper friction over the nominal one of every surface, where it is given. Raises InputError."""
    nominal = given_friction(bearing)
    cases = []
    for name, values in (("friction_lower", bearing.friction_lower), ("friction_upper", bearing.friction_upper)):
        if values is None:
            raise InputError(f"bearing.{name} is missing: give the bounds of friction, or a table of factors")
        at = given_friction(_with_nominal(bearing, values))
        cases.append(tuple(bound / mu if mu else 1.0 for bound, mu in zip(at, nominal, strict=True)))
    return cases[0], (1.0,) * len(nominal), cases[1]


def _with_nominal(bearing: Bearing, friction: tuple[float, ...]) -> Bearing:
    """The bearing with other coefficients at its surfaces, which are given where its own are."""
    other = bearing.replace(friction=friction)
    object.__setattr__(other, "_given_at", bearing.friction_given_at)
    return other


# SI unit -> (unit shown, scale).
SHOWN = {
    "m": ("mm", 1e3),
    "N": ("kN", 1e-3),
    "N/m": ("kN/m", 1e-3),
    "N m": ("MN m", 1e-6),
    "m/s": ("mm/s", 1e3),
    "W/m^2": ("kW/m2", 1e-3),
    "": ("%", 100.0),
}


def shown_as(unit: str) -> tuple[str, float]:
    """The unit in which a value of an SI unit is shown, and the factor from the SI unit to it."""
    return SHOWN.get(unit, (unit, 1.0))


def bounding_tables(bounds: Bounds) -> list[Table]:
    """Tables of factors, lambdas by surface, quantities and verdicts by case, failed runs, and undefined quantities."""
    failed = [(case.name, case.failure) for case in bounds.cases if case.failure]
    unknown = [(bounds.compared[name].words(name), why) for name, why in bounds.undefined().items()]
    extra = [Table("runs that failed", (), failed)] if failed else []
    extra += [Table("what is not defined, and why", (), unknown)] if unknown else []
    verdicts = Table("verdicts: limits of the device (docs/results.md)", (), list(bounds.verdicts().items()))
    return [_factor_table(bounds.table), _lambda_table(bounds), _quantity_table(bounds), verdicts, *extra]


def write_quantities(bounds: Bounds, path: str | Path) -> Path:
    """Write the quantities by case, and the verdicts, as CSV in SI units; the file appears only when complete.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    sources, quantities, governing = bounds.compared, bounds.quantities(), bounds.governing()
    undefined, verdicts = bounds.undefined(), bounds.verdicts()
    columns: dict[tuple[str, str], list[Any]] = {
        ("quantity", ""): [*(f"{name} [{sources[name].quantity.unit or 1}]" for name in quantities), "verdict"],
        **{(case, ""): [*(values[case] for values in quantities.values()), verdicts[case]] for case in CASES},
        ("governs", ""): [*(governing.get(name, "") for name in quantities), ""],
        ("not defined", ""): [*(undefined.get(name, "") for name in quantities), ""],
    }
    return write_columns(check_output(path, (".csv",)), columns)


def _factor_table(table: FactorTable) -> Table:
    rows = [("table", table.name), ("", table.description)]
    if table.rule:
        rows += [("rule", f"{table.rule}: {RULES[table.rule].formula}"), ("adjustment", f"{table.adjustment:g}")]
    rows.append(("source", table.source))
    if table.limits is not None:
        rows.append(("limits", f"lambda_min at most {table.limits[0]:g}, lambda_max at least {table.limits[1]:g}"))
    for factor in table.factors:
        causes = [
            f"{cause} {low:g} to {high:g}"
            for group in (factor.environment, factor.direct)
            for cause, (low, high) in group.items()
        ]
        where = f" of surface {', '.join(map(str, factor.surfaces))}" if factor.surfaces else ""
        low, high = table.combined(factor)
        rows.append((factor.property + where, f"{low:.4g} to {high:.4g} from {', '.join(causes)}"))
    return Table("property-modification factors", (), [row for row in rows if row[1]])


def _lambda_table(bounds: Bounds) -> Table:
    bearing = bounds.bearing
    at = " at the pivot" if bearing.friction_given_at == "pivot" else ""
    rows = []
    for name, factors in bounds.lambdas.items():
        nominal = [getattr(surface, name) for surface in bearing.surfaces]
        if name == "friction":
            nominal = list(given_friction(bearing))
        label = f"{name}{at if name == 'friction' else ''}"
        for surface, value in enumerate(nominal):
            lambdas = [factors[case][surface] for case in CASES]
            cells = [f"{number:.4g}" for number in (*lambdas, *(value * factor for factor in lambdas))]
            rows.append((f"{label} {surface + 1}", *cells))
    return Table("lambda of every surface, and property times lambda [SI]", ("", *CASES, *CASES), rows)


def _quantity_table(bounds: Bounds) -> Table:
    sources, governing, places = bounds.compared, bounds.governing(), bounds.places()
    rows = []
    for name, values in bounds.quantities().items():
        if any(value is not None for value in values.values()):
            unit, scale = shown_as(sources[name].quantity.unit)
            cells = ["-" if (value := values[case]) is None else f"{value * scale:.4g}" for case in CASES]
            rows.append((f"{sources[name].words(name)} [{unit}]", *cells, governing.get(name, "")))
        if texts := places.get(name):
            rows.append((f"{sources[name].words(name)} is of", *(texts[case] or "-" for case in CASES), ""))
    return Table("results; properties of cycles are their means", ("", *CASES, "governs"), rows)


def plot_bounds(bounds: Bounds, path: str | Path | None = None) -> Figure:
    """Top force [kN] over displacement across the bearing [mm] of all cases, along each axis that moves.

    A run that failed is drawn up to its last row; a run without rows is not drawn. Raises InputError for a path that
    cannot be written.
    """
    plotted = [case for name in CASE_COLOURS for case in bounds.cases if case.name == name and case.result is not None]
    axes = sorted({axis for case in plotted for axis in axes_along(_loop(case.result)[0])}) or [0]
    with page(6.4 * len(axes), 5.0, path, "bounds") as figure:
        name = next(case.scene.name for case in bounds.cases if case.name == "nominal") or "unnamed scene"
        headline(figure, f"{name}: bounds by {bounds.table.name}")
        for axis, place in zip(axes, figure.subplots(1, len(axes), squeeze=False)[0], strict=True):
            _draw(place, bounds, plotted, axis)
    return figure


def _draw(axes: Axes, bounds: Bounds, cases: list[Case], axis: int) -> None:
    loops = [_loop(case.result) for case in cases]
    forces = [force[:, axis] for _, force in loops]
    scale = engineering(np.concatenate(forces), "N") if forces else engineering(0.0, "N")
    for case, (u, _), values in zip(cases, loops, forces, strict=True):
        style: dict[str, Any] = {"color": CASE_COLOURS[case.name], "linewidth": THIN, "label": _label(bounds, case)}
        axes.plot(displacement(u[:, axis]), force(values, scale), **style)
    sign = subscript(axis + 1)
    axes.set(
        title=f"Force and displacement along E{sign}",
        xlabel=f"displacement across the bearing {displacement_label(axis)}",
        ylabel=f"force {shown_sign().force} F{sign} [{scale.unit}]",
    )
    axes.margins(0.06)
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: CASES.index(cases[i].name))
    axes.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left")


def _loop(result: Any) -> tuple[Array, Array]:
    """Mean displacement across the bearings [m] and sum of the forces on their tops [N], both shape (k, 3)."""
    rows = [bearing.history for bearing in result.bearings]
    return np.mean([row.displacement for row in rows], axis=0), np.sum([row.top_force for row in rows], axis=0)


def _label(bounds: Bounds, case: Case) -> str:
    """Name of the case and its factors for a legend; equal factors of surfaces are one number."""
    lambdas = []
    for name, factors in bounds.lambdas.items():
        values = list(dict.fromkeys(f"{value:.3g}" for value in factors[case.name]))
        lambdas.append(f"{name.replace('_', ' ')} × {' / '.join(values)}")
    return f"{case.name}: {', '.join(lambdas)}" + (", run failed" if case.failure else "")
