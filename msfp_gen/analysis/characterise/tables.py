"""Output of a characterisation: tables for the console, and a CSV file with one row per cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import atan2, degrees
from pathlib import Path

from msfp_gen.analysis.characterise.report import LOOP_QUANTITIES, Characterisation, Cycle, loop_quantity
from msfp_gen.analysis.characterise.stages import Branch
from msfp_gen.analysis.characterise.surfaces import SurfaceDemand
from msfp_gen.common.output import check_output
from msfp_gen.common.tables import Table, write_rows

CSV_SUFFIXES = (".csv",)
UNITS = {
    "effective_stiffness": "N/m",
    "effective_period": "s",
    "energy_dissipated": "J",
    "effective_damping": "1",
    "zero_displacement_force": "N",
}
# Columns of the table of cycles: heading and scale of each of LOOP_QUANTITIES.
SHOWN = {
    "effective_stiffness": ("k_eff [kN/m]", 1e-3),
    "effective_period": ("T_eff [s]", 1.0),
    "energy_dissipated": ("loop area [J]", 1.0),
    "effective_damping": ("damping [%]", 100.0),
    "zero_displacement_force": ("Q at zero [kN]", 1e-3),
}
DEMAND_UNITS = {
    "capacity_left": "m",
    "peak_velocity": "m/s",
    "peak_heat_flux": "W/m^2",
    "heat": "J/m^2",
    "maximum_uplift": "m",
}
TIMES = {"start [s]", "end [s]"}  # columns that have no envelope
Row = dict[str, float | str | None]


def characterisation_tables(characterisation: Characterisation) -> list[Table]:
    """Tables of the run, its cycles, the sliding regimes of first loading and last cycle, and the surfaces."""
    tables = [_run_table(characterisation)]
    if characterisation.cycles:
        tables.append(_cycle_table(characterisation))
    branches = list(_named_branches(characterisation))
    if branches:
        tables.append(_stage_table(branches))
    tables.append(_surface_table(characterisation.surfaces))
    if characterisation.notes:
        tables.append(
            Table("what is not defined in this run, and why", (), [(note,) for note in characterisation.notes])
        )
    return tables


def write_csv(characterisation: Characterisation, path: str | Path) -> Path:
    """Write one row per cycle, then least, mean and largest values of the cycles, then the run, to a CSV file.

    The file appears only when complete. Raises InputError for a path that does not end in .csv or cannot be written.
    """
    return write_rows(check_output(path, CSV_SUFFIXES), csv_rows(characterisation))


def csv_rows(characterisation: Characterisation) -> list[Row]:
    """The rows of `write_csv`: column with its unit -> value; None and missing columns are empty cells."""
    cycles = [{"scope": f"cycle {cycle.number}", **_cycle_row(cycle)} for cycle in characterisation.cycles]
    whole: Row = {
        "scope": "run",
        "peak_displacement [m]": characterisation.peak_displacement,
        "peak_force [N]": characterisation.peak_force,
        "secant_stiffness [N/m]": characterisation.secant_stiffness,
        "total_energy_dissipated [J]": characterisation.energy_dissipated,
        "residual_displacement [m]": characterisation.residual_displacement if characterisation.at_rest else None,
        **_demand_row(characterisation.surfaces),
    }
    return [*cycles, *_envelope_rows(cycles), whole]


def _envelope_rows(cycles: list[Row]) -> Iterator[Row]:
    kinds: dict[str, Callable[[list[float]], float]] = {
        "least": min,
        "mean": lambda values: sum(values) / len(values),
        "most": max,
    }
    for scope, pick in kinds.items() if cycles else ():
        row: Row = {"scope": scope}
        for name in (key for key in cycles[0] if key not in TIMES):
            values = [value for cycle in cycles if isinstance(value := cycle.get(name), float)]
            if values and len(values) == len(cycles):
                row[name] = pick(values)
        yield row


def _cycle_row(cycle: Cycle) -> Row:
    loop = cycle.loop
    row: Row = {
        "start [s]": cycle.start,
        "end [s]": cycle.end,
        "displacement_most [m]": loop.displacement_most,
        "displacement_least [m]": loop.displacement_least,
        "force_most [N]": loop.force_most,
        "force_least [N]": loop.force_least,
        **{f"{name} [{UNITS[name]}]": loop_quantity(cycle, name) for name in LOOP_QUANTITIES},
        "balance_energy [J]": cycle.balance_energy,
    }
    stages = cycle.stage_stiffness().items()
    stiffness: Row = {f"stiffness sliding on {_joined(surfaces)} [N/m]": value for surfaces, value in stages}
    return row | stiffness | _demand_row(cycle.surfaces)


def _demand_row(demands: tuple[SurfaceDemand, ...]) -> Row:
    return {
        f"{name}_{demand.surface} [{unit}]": getattr(demand, name)
        for demand in demands
        for name, unit in DEMAND_UNITS.items()
    }


def _run_table(characterisation: Characterisation) -> Table:
    load, rest = characterisation.axial_load, "at rest" if characterisation.at_rest else "still moving"
    ratio = f", {characterisation.peak_force / load:.4f} of the axial load" if load else ""
    angle = degrees(atan2(characterisation.direction[1], characterisation.direction[0]))
    lift = (
        "not modelled" if characterisation.maximum_uplift is None else f"{characterisation.maximum_uplift * 1e3:.3f} mm"
    )
    rows = [
        ("motion", f"{characterisation.kind}; largest displacement at {angle:.1f} degrees from E1"),
        ("peak displacement", f"{characterisation.peak_displacement * 1e3:.2f} mm"),
        ("peak force", f"{characterisation.peak_force / 1e3:.3f} kN{ratio}"),
        ("secant stiffness", _number(characterisation.secant_stiffness, 1e-3, " kN/m at the largest displacement")),
        ("energy dissipated", f"{characterisation.energy_dissipated:.5g} J in the whole run"),
        ("displacement at the end", f"{characterisation.residual_displacement * 1e3:.2f} mm, {rest}"),
        ("maximum uplift", lift),
    ]
    return Table(f"{characterisation.name or 'unnamed scene'}, {characterisation.status}", (), rows)


def _cycle_table(characterisation: Characterisation) -> Table:
    columns = ("cycle", "least u [mm]", "largest u [mm]", *(heading for heading, _ in SHOWN.values()))
    rows = []
    for cycle in characterisation.cycles:
        ends = (cycle.loop.displacement_least, cycle.loop.displacement_most)
        numbers = [_number(loop_quantity(cycle, name), scale) for name, (_, scale) in SHOWN.items()]
        rows.append((str(cycle.number), *(f"{end * 1e3:.2f}" for end in ends), *numbers))
    for scope in ("least", "mean", "most"):
        ranges = [(characterisation.envelope.get(name), scale) for name, (_, scale) in SHOWN.items()]
        numbers = ["-" if at is None else _number(getattr(at, scope), scale) for at, scale in ranges]
        rows.append((scope, "", "", *numbers))
    return Table("closed cycles", columns, rows)


def _named_branches(characterisation: Characterisation) -> Iterator[tuple[str, Branch]]:
    if characterisation.first_loading is not None:
        yield "first loading", characterisation.first_loading
    if characterisation.cycles:
        last = characterisation.cycles[-1]
        for half, branch in enumerate(last.branches, start=1):
            yield f"cycle {last.number}, half {half}", branch


def _stage_table(branches: list[tuple[str, Branch]]) -> Table:
    columns = ("path", "sliding", "from u [mm]", "to u [mm]", "stiffness [kN/m]", "intercept [kN]", "scatter [kN]")
    rows = [
        (
            name if not index else "",
            _joined(stage.surfaces),
            f"{stage.start * 1e3:.2f}",
            f"{stage.end * 1e3:.2f}",
            f"{stage.stiffness / 1e3:.4g}",
            f"{stage.intercept / 1e3:.4g}",
            f"{stage.scatter / 1e3:.2g}",
        )
        for name, branch in branches
        for index, stage in enumerate(branch.stages)
    ]
    return Table("sliding regimes: surfaces that slide, and the straight line fitted to the force", columns, rows)


def _surface_table(demands: tuple[SurfaceDemand, ...]) -> Table:
    columns = (
        "surface",
        "capacity left [mm]",
        "of capacity [%]",
        "velocity [mm/s]",
        "heat flux [kW/m2]",
        "heat [kJ/m2]",
        "uplift [mm]",
    )
    rows = [
        (
            str(demand.surface),
            f"{demand.capacity_left * 1e3:.2f}",
            f"{demand.capacity_left_share * 100:.1f}",
            _number(demand.peak_velocity, 1e3),
            _number(demand.peak_heat_flux, 1e-3),
            _number(demand.heat, 1e-3),
            _number(demand.maximum_uplift, 1e3),
        )
        for demand in demands
    ]
    return Table("surfaces, bottom first: least capacity left, largest velocity, heat and uplift", columns, rows)


def _joined(surfaces: tuple[int, ...]) -> str:
    return "+".join(map(str, surfaces)) or "none"


def _number(value: float | None, scale: float = 1.0, unit: str = "") -> str:
    return "-" if value is None else f"{value * scale:.4g}{unit}"
