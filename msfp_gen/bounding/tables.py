"""A bounding analysis for people: the factors, and lower, nominal and upper side by side."""

from __future__ import annotations

import csv
from pathlib import Path

from msfp_gen.bounding.factors import RULES, FactorTable
from msfp_gen.bounding.runs import CASES, Bounds, measures
from msfp_gen.output import check_output, replacing
from msfp_gen.tables import Table

# Unit in SI -> unit shown and its scale.
SHOWN = {"m": ("mm", 1e3), "N": ("kN", 1e-3), "N/m": ("kN/m", 1e-3), "m/s": ("mm/s", 1e3), "W/m^2": ("kW/m2", 1e-3),
         "1": ("%", 100.0)}  # fmt: skip


def bounding_tables(found: Bounds) -> list[Table]:
    """The table of factors, the factors of every surface, quantities side by side, and what failed."""
    failed = [(case.name, case.failure) for case in found.cases if case.failure]
    extra = [Table("runs that failed", (), failed)] if failed else []
    return [_factor_table(found.table), _lambda_table(found), _quantity_table(found), *extra]


def write_quantities(found: Bounds, path: str | Path) -> Path:
    """Quantities side by side as CSV, in SI; whole or not at all. Raises InputError for a path that cannot be."""
    path = check_output(path, (".csv",))
    units, governing = measures(found.surfaces), found.governing()
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["quantity", *CASES, "governs"])
        for name, values in found.quantities().items():
            cells = ["" if values[case] is None else values[case] for case in CASES]
            writer.writerow([f"{name} [{units[name].unit}]", *cells, governing.get(name, "")])
    return path


def _factor_table(table: FactorTable) -> Table:
    rows = [("table", table.name), ("", table.description), ("rule", f"{table.rule}: {RULES[table.rule].formula}"),
            ("adjustment", f"{table.adjustment:g}"), ("source", table.source)]  # fmt: skip
    if table.limits is not None:
        rows.append(("limits", f"lambda_min at most {table.limits[0]:g}, lambda_max at least {table.limits[1]:g}"))
    for factor in table.factors:
        causes = [f"{cause} {low:g} to {high:g}"
                  for group in (factor.environment, factor.direct) for cause, (low, high) in group.items()]  # fmt: skip
        where = f" of surface {', '.join(map(str, factor.surfaces))}" if factor.surfaces else ""
        low, high = table.combined(factor)
        rows.append((factor.property + where, f"{low:.4g} to {high:.4g} from {', '.join(causes)}"))
    return Table("property-modification factors", (), [row for row in rows if row[1]])


def _lambda_table(found: Bounds) -> Table:
    nominal = next(case for case in found.cases if case.name == "nominal").scene.bearing.surfaces
    rows = [
        (f"{named} {surface + 1}", *(f"{factors[case][surface]:.4g}" for case in CASES),
         *(f"{factors[case][surface] * getattr(nominal[surface], named):.4g}" for case in CASES))
        for named, factors in found.lambdas.items() for surface in range(found.surfaces)
    ]  # fmt: skip
    return Table("lambda of every surface, and the value it gives [SI]", ("", *CASES, *CASES), rows)


def _quantity_table(found: Bounds) -> Table:
    units, governing = measures(found.surfaces), found.governing()
    rows = []
    for name, values in found.quantities().items():
        if any(value is not None for value in values.values()):
            unit, scale = SHOWN.get(units[name].unit, (units[name].unit, 1.0))
            cells = ["-" if (value := values[case]) is None else f"{value * scale:.4g}" for case in CASES]
            rows.append((f"{name.replace('_', ' ')} [{unit}]", *cells, governing.get(name, "")))
    return Table("side by side; numbers of cycles are their means", ("", *CASES, "governs"), rows)
