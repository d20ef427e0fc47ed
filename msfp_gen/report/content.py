"""What the page says in numbers and words: every number is one of the result's, and none depends on the machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from msfp_gen.errors import InputError
from msfp_gen.explain import explain
from msfp_gen.tables import Table, transition_table, yes

if TYPE_CHECKING:
    from msfp_gen.result import Result

MILLI, KILO = 1e3, 1e-3
PLACE = ("build_seconds",)  # of the provenance: how long this machine took
EVENTS = 40  # listed; an earthquake may meet a rim at every cycle


class Figure(str):
    """A number as text that remembers which number of `Result.summary` it is, by a dotted path, and its value in SI."""

    key: str
    value: float


def summary_page(result: Result) -> list[Table]:
    """Peaks, surfaces, stages and events: the summary as `msfp-gen run` prints it, less what the machine did."""
    tables = [_run_table(result), _surface_table(result)]
    if "transitions" in result.summary:
        tables.append(transition_table(result.summary["transitions"]))
    if result.events:
        tables.append(_event_table(result))
    return tables


def characterisation_page(result: Result) -> list[Table]:
    """What engineers sign off; nothing where the bearing did not move."""
    from msfp_gen.characterise.tables import characterisation_tables

    try:
        return characterisation_tables(result.characterise())
    except InputError:
        return []


def settings_page(result: Result) -> list[Table]:
    """Bearing, motion, top, effects and solver in plain words."""
    return explain(result.scene)


def provenance_table(result: Result) -> Table:
    """How the numbers came about: versions, model, method, and the work of the solver."""
    words = {name.replace("_", " "): value for name, value in result.provenance.items() if name not in PLACE}
    work = {name.replace("_", " "): str(count) for name, count in asdict(result.counters).items()}
    work.pop("wall time")
    return Table("how these numbers came about", (), [*words.items(), *work.items()])


def verdict(result: Result) -> str:
    """How the run ended, in words."""
    ends = {"ok": "The run reached its end.", "stopped": "The run ended at the stop it was asked for."}
    return ends.get(result.status, f"The run failed ({result.status}): {result.message}")


def _run_table(result: Result) -> Table:
    rows: list[tuple[str, str]] = [("status", result.status)]
    wanted = {
        "duration": ("time simulated", 1.0, "s"),
        "peak_displacement.radial": ("peak horizontal displacement", MILLI, "mm"),
        "peak_displacement.E1": ("peak displacement along E1", MILLI, "mm"),
        "peak_displacement.E2": ("peak displacement along E2", MILLI, "mm"),
        "peak_top_force.radial": ("peak horizontal force on the top", KILO, "kN"),
        "peak_top_force.E1": ("peak force along E1", KILO, "kN"),
        "peak_top_force.E2": ("peak force along E2", KILO, "kN"),
        "axial_load": ("axial load", KILO, "kN"),
        "peak_force_ratio": ("peak horizontal force over axial load", 1.0, ""),
        "energy.peak_input": ("peak work put in", KILO, "kJ"),
        "energy.dissipated_share": ("share of it dissipated", 100.0, "%"),
        "energy.closure_error": ("share of it that the energy balance misses", 100.0, "%"),
    }
    for key, (name, scale, unit) in wanted.items():
        figure = _figure(result, key, scale, unit)
        if figure is not None:
            rows.append((name, figure))
    return Table("the run", (), rows)


def _surface_table(result: Result) -> Table:
    surfaces, met = result.scene.bearing.surfaces, result.summary["rims_met"]
    columns = {
        "peak sliding [mm]": ("peak_sliding", MILLI),
        "least gap [mm]": ("minimum_gap", MILLI),
        "N least [kN]": ("minimum_normal_force", KILO),
        "N most [kN]": ("maximum_normal_force", KILO),
        "mu least": ("least_friction", 1.0),
        "mu most": ("most_friction", 1.0),
        "peak T [degC]": ("peak_temperature", 1.0),
    }
    columns = {name: column for name, column in columns.items() if column[0] in result.summary}
    rows = [
        (str(index + 1), f"{surface.capacity * MILLI:.5g}", yes(index + 1 in met),
         *(_figure(result, f"{key}.{index}", scale) or "-" for key, scale in columns.values()))
        for index, surface in enumerate(surfaces)
    ]  # fmt: skip
    return Table("surfaces, bottom first", ("surface", "capacity [mm]", "rim met", *columns), rows)


def _event_table(result: Result) -> Table:
    shown = result.events[:EVENTS]
    more = f", the first {EVENTS} of {len(result.events)}" if len(result.events) > EVENTS else ""
    rows = [
        (f"{event.time:.4f}", event.kind.replace("_", " "), str(event.surface or "-"),
         *(f"{value * MILLI:.2f}" for value in event.displacement[:2]),
         *(f"{value * KILO:.3f}" for value in event.top_force[:2]))
        for event in shown
    ]  # fmt: skip
    columns = ("time [s]", "event", "surface", "u1 [mm]", "u2 [mm]", "F1 [kN]", "F2 [kN]")
    return Table(f"events{more}", columns, rows)


def _figure(result: Result, key: str, scale: float, unit: str = "") -> Figure | None:
    """One number of the summary for a person; None where the summary has none."""
    value: Any = result.summary
    for part in key.split("."):
        value = value[int(part) if isinstance(value, list) else part]
    if value is None:
        return None
    figure = Figure(f"{value * scale:.5g} {unit}".rstrip())
    figure.key, figure.value = key, float(value)
    return figure


def numbers(tables: list[Table]) -> Iterator[Figure]:
    """Every number of the summary that the tables show."""
    return (cell for table in tables for row in table.rows for cell in row if isinstance(cell, Figure))
