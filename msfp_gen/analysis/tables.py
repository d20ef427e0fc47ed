"""Tables of a run for the console: peaks, surfaces, transitions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from msfp_gen.analysis.transitions import SYMBOLS
from msfp_gen.common.tables import Table, yes

if TYPE_CHECKING:
    from msfp_gen.scene.bearing import Surface

MEANINGS = {
    "u_star": "surface 2 stops sliding",
    "u_star_star": "surface 3 stops sliding",
    "u_dr": "first contact with rim {}",
    "F_dr": "force over axial load at first contact with rim {}",
    "resolution": "largest spacing of rows at u* and u**",
}


def work_rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Label and value of the energy of a run of one bearing, and of the work of the solver."""
    counters = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in summary["counters"].items() if count)
    return [("energy", _energy(summary["energy"])), ("solver", counters)]


# Column -> (key of the values, scale, format). Columns whose key a run does not have are left out.
SURFACE_COLUMNS: dict[str, tuple[str, float, str]] = {
    "peak sliding [mm]": ("peak_sliding", 1e3, ".2f"),
    "capacity [mm]": ("capacity", 1e3, ".2f"),
    "least gap [mm]": ("minimum_gap", 1e3, ".2f"),
    "rim met": ("rim_met", 1, ""),
    "rim [kN]": ("peak_rim_force", 1e-3, ".2f"),
    "least N [kN]": ("minimum_normal_force", 1e-3, ".3f"),
    "peak N [kN]": ("maximum_normal_force", 1e-3, ".3f"),
    "least mu": ("least_friction", 1.0, ".4f"),
    "peak mu": ("most_friction", 1.0, ".4f"),
    "peak T [degC]": ("peak_temperature", 1.0, ".1f"),
}


def surface_table(summary: Mapping[str, Any], surfaces: Sequence[Surface]) -> Table:
    """Peaks of the surfaces of a bearing."""
    values: dict[str, Any] = {
        **summary,
        "capacity": [surface.capacity for surface in surfaces],
        "rim_met": [yes(index + 1 in summary["rims_met"]) for index in range(len(surfaces))],
    }
    if not any(summary["peak_rim_force"]):
        del values["peak_rim_force"]
    columns = {name: column for name, column in SURFACE_COLUMNS.items() if column[0] in values}
    rows = [
        (str(index + 1), *(format(values[key][index] * scale, style) for key, scale, style in columns.values()))
        for index in range(len(surfaces))
    ]
    return Table("surfaces, bottom first", ("surface", *columns), rows)


def transition_table(transitions: Mapping[str, float | None]) -> Table:
    """Transitions between the sliding regimes of a monotonic run; keys as in `transitions.transitions`."""
    rows = []
    for key, value in transitions.items():
        kind = key.rstrip("0123456789")
        shown = "none" if value is None else f"{value:.4f}" if kind == "F_dr" else f"{value * 1e3:.2f} mm"
        rows.append((SYMBOLS.get(key, key), shown, MEANINGS[kind].format(key.removeprefix(kind))))
    return Table("transitions between sliding regimes (PEER 2017/07, Table 4.2)", (), rows)


def _energy(energy: Mapping[str, float | None]) -> str:
    if energy["closure_error"] is None:
        return "no energy input"
    return (
        f"balance closes to {energy['closure_error']:.2g} of the peak input {energy['peak_input']:.4g} J, "
        f"{energy['dissipated_share']:.1%} dissipated"
    )
