"""Output of a bounding analysis: tables of factors and of quantities by case, and a CSV file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_columns
from msfp_gen.studies.bounding.factors import RULES, FactorTable
from msfp_gen.studies.bounding.runs import CASES, Bounds

# SI unit -> (unit shown, scale).
SHOWN = {
    "m": ("mm", 1e3),
    "N": ("kN", 1e-3),
    "N/m": ("kN/m", 1e-3),
    "m/s": ("mm/s", 1e3),
    "W/m^2": ("kW/m2", 1e-3),
    "1": ("%", 100.0),
}


def bounding_tables(found: Bounds) -> list[Table]:
    """Tables of the factors, of the factors by surface, of quantities by case, and of runs that failed."""
    failed = [(case.name, case.failure) for case in found.cases if case.failure]
    extra = [Table("runs that failed", (), failed)] if failed else []
    return [_factor_table(found.table), _lambda_table(found), _quantity_table(found), *extra]


def write_quantities(found: Bounds, path: str | Path) -> Path:
    """Write the quantities by case as CSV in SI units; the file appears only when complete.

    Raises InputError for a path that does not end in .csv or cannot be written.
    """
    units, quantities, governing = found.measures, found.quantities(), found.governing()
    columns: dict[tuple[str, str], list[Any]] = {
        ("quantity", ""): [f"{name} [{units[name].unit}]" for name in quantities],
        **{(case, ""): [values[case] for values in quantities.values()] for case in CASES},
        ("governs", ""): [governing.get(name, "") for name in quantities],
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


def _lambda_table(found: Bounds) -> Table:
    nominal = found.bearing.surfaces
    rows = [
        (
            f"{named} {surface + 1}",
            *(f"{factors[case][surface]:.4g}" for case in CASES),
            *(f"{factors[case][surface] * getattr(nominal[surface], named):.4g}" for case in CASES),
        )
        for named, factors in found.lambdas.items()
        for surface in range(found.surfaces)
    ]
    return Table("lambda of every surface, and property times lambda [SI]", ("", *CASES, *CASES), rows)


def _quantity_table(found: Bounds) -> Table:
    units, governing = found.measures, found.governing()
    rows = []
    for name, values in found.quantities().items():
        if any(value is not None for value in values.values()):
            unit, scale = SHOWN.get(units[name].unit, (units[name].unit, 1.0))
            cells = ["-" if (value := values[case]) is None else f"{value * scale:.4g}" for case in CASES]
            rows.append((f"{name.replace('_', ' ')} [{unit}]", *cells, governing.get(name, "")))
    return Table("results; properties of cycles are their means", ("", *CASES, "governs"), rows)
