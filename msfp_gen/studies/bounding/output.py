"""Output of a bounding analysis: tables of factors and of quantities by case, as CSV, and the loops of all cases."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.buildings.result import BuildingResult
from msfp_gen.common.arrays import Array
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.figures import COLOURS, INK, displacement, displacement_label, engineering, force, page
from msfp_gen.figures.bearing import axes_along
from msfp_gen.figures.style import THIN, headline, subscript
from msfp_gen.results.sign import shown_sign
from msfp_gen.studies.bounding.factors import RULES, FactorTable
from msfp_gen.studies.bounding.runs import CASES, Bounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from msfp_gen.result import Result
    from msfp_gen.studies.bounding.runs import Bounds, Case

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
# In the order of drawing: the nominal loop lies on top. Solid lines, since repeated cycles would fill dashes.
LINE_STYLES: dict[str, dict[str, Any]] = {
    "lower": {"color": COLOURS[0]},
    "upper": {"color": COLOURS[1]},
    "nominal": {"color": INK},
}


def shown_as(unit: str) -> tuple[str, float]:
    """The unit in which a value in SI is shown, and the factor to it."""
    return SHOWN.get(unit, (unit, 1.0))


def bounding_tables(bounds: Bounds) -> list[Table]:
    """Tables of the factors, of the factors by surface, of quantities and verdicts by case, and of runs that failed."""
    failed = [(case.name, case.failure) for case in bounds.cases if case.failure]
    unknown = [(name.replace("_", " "), why) for name, why in bounds.undefined().items()]
    extra = [Table("runs that failed", (), failed)] if failed else []
    extra += [Table("what is not defined, and why", (), unknown)] if unknown else []
    verdicts = Table("verdicts: limits of the device (docs/limits.md)", (), list(bounds.verdicts().items()))
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
    rows = [
        ("table", table.name),
        ("", table.description),
        ("rule", f"{table.rule}: {RULES[table.rule].formula}"),
        ("adjustment", f"{table.adjustment:g}"),
        ("source", table.source),
    ]
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
    nominal = bounds.bearing.surfaces
    rows = [
        (
            f"{named} {surface + 1}",
            *(f"{factors[case][surface]:.4g}" for case in CASES),
            *(f"{factors[case][surface] * getattr(nominal[surface], named):.4g}" for case in CASES),
        )
        for named, factors in bounds.lambdas.items()
        for surface in range(bounds.surfaces)
    ]
    return Table("lambda of every surface, and property times lambda [SI]", ("", *CASES, *CASES), rows)


def _quantity_table(bounds: Bounds) -> Table:
    sources, governing = bounds.compared, bounds.governing()
    rows = []
    for name, values in bounds.quantities().items():
        if any(value is not None for value in values.values()):
            unit, scale = shown_as(sources[name].quantity.unit)
            cells = ["-" if (value := values[case]) is None else f"{value * scale:.4g}" for case in CASES]
            rows.append((f"{name.replace('_', ' ')} [{unit}]", *cells, governing.get(name, "")))
    return Table("results; properties of cycles are their means", ("", *CASES, "governs"), rows)


def plot_bounds(bounds: Bounds, path: str | Path | None = None) -> Figure:
    """Top force [kN] over displacement across the bearing [mm] of all cases, along each axis that moves.

    A run that failed is drawn up to its last row, one without rows is left out. Raises InputError for a path that
    cannot be written.
    """
    drawn = [case for name in LINE_STYLES for case in bounds.cases if case.name == name and case.result is not None]
    axes = sorted({axis for case in drawn for axis in axes_along(_loop(case.result)[0])}) or [0]
    with page(6.4 * len(axes), 5.0, path, "bounds") as figure:
        name = next(case.scene.name for case in bounds.cases if case.name == "nominal") or "unnamed scene"
        headline(figure, f"{name}: bounds by {bounds.table.name}")
        for axis, place in zip(axes, figure.subplots(1, len(axes), squeeze=False)[0], strict=True):
            _draw(place, bounds, drawn, axis)
    return figure


def _draw(axes: Axes, bounds: Bounds, cases: list[Case], axis: int) -> None:
    loops = [_loop(case.result) for case in cases]
    forces = [force[:, axis] for _, force in loops]
    scale = engineering(np.concatenate(forces), "N") if forces else engineering(0.0, "N")
    for case, (u, _), values in zip(cases, loops, forces, strict=True):
        axes.plot(
            displacement(u[:, axis]),
            force(values, scale),
            label=_label(bounds, case),
            linewidth=THIN,
            **LINE_STYLES[case.name],
        )
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


def _loop(result: Result | BuildingResult | None) -> tuple[Array, Array]:
    """Displacement across the bearing [m] and force on its top [N], of a building their mean and sum, shape (k, 3)."""
    assert result is not None  # cases without rows are not drawn
    if isinstance(result, BuildingResult):
        u = np.mean([bearing.history.displacement for bearing in result.bearings], axis=0)
        return u, np.sum([bearing.history.top_force for bearing in result.bearings], axis=0)
    return result.history.displacement, result.history.top_force


def _label(bounds: Bounds, case: Case) -> str:
    """Name of the case and its factors; one number if all surfaces have the same."""
    parts = []
    for named, factors in bounds.lambdas.items():
        values = list(dict.fromkeys(f"{value:.3g}" for value in factors[case.name]))
        parts.append(f"{named.replace('_', ' ')} × {' / '.join(values)}")
    return f"{case.name}: {', '.join(parts)}" + (", run failed" if case.failure else "")
