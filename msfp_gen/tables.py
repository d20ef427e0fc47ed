"""Tables as data, and the tables of a run: aligned text for pipes and logs, rich ones where a person looks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msfp_gen.transitions import SYMBOLS

if TYPE_CHECKING:
    from rich.table import Table as RichTable

    from msfp_gen.build import BuildInfo
    from msfp_gen.doctor import Check
    from msfp_gen.result import Result

MEANINGS = {
    "u_star": "surface 2 stops",
    "u_star_star": "surface 3 stops",
    "u_dr": "rim {} met",
    "F_dr": "force over axial load when rim {} was met",
    "resolution": "spacing of rows about the stops of surfaces",
}


@dataclass(frozen=True)
class Table:
    """A heading, the names of columns (none: rows are name and value) and rows of text, ready to print."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    @property
    def text(self) -> str:
        """Aligned columns: the first to the left, numbers of the others to the right."""
        lines = [row for row in (self.columns, *self.rows) if row]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        body = ["  " + "  ".join(self._cell(row, i, widths[i]) for i in range(len(row))).rstrip() for row in lines]
        return "\n".join([self.title, *body])

    def _cell(self, row: Sequence[str], column: int, width: int) -> str:
        return row[column].rjust(width) if self.columns and column else row[column].ljust(width)

    def rich(self) -> RichTable:
        """The same for a terminal."""
        from rich import box
        from rich.table import Table as RichTable
        from rich.text import Text

        width = len(self.rows[0]) if self.rows else len(self.columns)
        table = RichTable(title=Text(self.title, style="bold"), title_justify="left", box=box.SIMPLE_HEAD,
                          show_header=bool(self.columns))  # fmt: skip
        for index in range(width):
            right = bool(self.columns) and index > 0
            table.add_column(Text(self.columns[index]) if self.columns else "", justify="right" if right else "left")
        for row in self.rows:
            table.add_row(*map(Text, row))
        return table


def summary_tables(result: Result) -> list[Table]:
    """What a person wants to know of a run: peaks, every surface, and the stages of a monotonic run."""
    summary = result.summary
    tables = [_run_table(summary), _surface_table(result)]
    if "transitions" in summary:
        tables.append(transition_table(summary["transitions"]))
    return tables


def batch_table(results: Sequence[Result]) -> Table:
    """Many runs, one a row: how each ended, its peaks, and how it was run."""
    rows = [
        (
            run["name"] or "unnamed scene", run["status"], f"{run['peak_displacement']['radial'] * 1e3:.2f}",
            f"{run['peak_top_force']['radial'] * 1e-3:.3f}", str(len(run["rims_met"])), f"{run['wall_time'] * 1e3:.1f}",
            result.provenance.get("batch", ""),
        )
        for result in results for run in (result.summary,)
    ]  # fmt: skip
    columns = ("scene", "status", "peak displacement [mm]", "peak force [kN]", "rims met", "time [ms]", "run")
    return Table(f"{len(results)} runs", columns, rows)


def build_table(info: BuildInfo) -> Table:
    """What a build cost, what it holds and where it lies."""
    stages = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in info.stages.items())
    origin = "found in the cache" if info.cached else "built now"
    return Table(info.spec, (), [
        ("stages", stages),
        ("this call", f"{info.seconds:.2f} s, {origin}"),
        ("kernels", f"{info.statements} statements, {info.operations} operations"),
        ("module", info.module),
        ("folder", str(info.folder)),
        ("extension", info.path.name),
    ])  # fmt: skip


def check_table(checks: Iterable[Check]) -> Table:
    """What `doctor` found."""
    rows = [
        (check.name, *(("ok", check.detail) if check.ok else ("MISSING", f"{check.detail}; {check.remedy}")))
        for check in checks
    ]
    return Table("msfp-gen doctor", (), rows)


def yes(value: object) -> str:
    """The word yes, or a dash."""
    return "yes" if value else "-"


def vector(values: Iterable[float], scale: float = 1.0) -> str:
    """Components of a vector for a person."""
    return ", ".join(f"{value * scale:.4g}" for value in values)


def _run_table(summary: Mapping[str, Any]) -> Table:
    displacement, force, energy = summary["peak_displacement"], summary["peak_top_force"], summary["energy"]
    ratio, counters = summary["peak_force_ratio"], summary["counters"]
    over = "" if ratio is None else f", radial over axial load {ratio:.4f}"
    rows = [
        ("status", " - ".join(filter(None, (summary["status"], summary["message"])))),
        ("time simulated", _speed(summary)),
        ("peak displacement", f"{_peaks(displacement, 1e3)} mm"),
        ("peak force on the top", f"{_peaks(force, 1e-3)} kN{over}"),
        ("energy", _energy(energy)),
        ("work", ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in counters.items() if count)),
    ]
    return Table(summary["name"] or "unnamed scene", (), rows)


# Column -> name of the values, scale (of texts 1), format; what a run does not have has no column.
SURFACE_COLUMNS: dict[str, tuple[str, float, str]] = {
    "peak sliding [mm]": ("peak_sliding", 1e3, ".2f"),
    "capacity [mm]": ("capacity", 1e3, ".2f"),
    "least gap [mm]": ("minimum_gap", 1e3, ".2f"),
    "rim met": ("rim_met", 1, ""),
    "N least [kN]": ("minimum_normal_force", 1e-3, ".3f"),
    "N most [kN]": ("maximum_normal_force", 1e-3, ".3f"),
    "mu least": ("least_friction", 1.0, ".4f"),
    "mu most": ("most_friction", 1.0, ".4f"),
    "peak T [degC]": ("peak_temperature", 1.0, ".1f"),
}


def _surface_table(result: Result) -> Table:
    summary, surfaces = result.summary, result.scene.bearing.surfaces
    values: dict[str, Any] = {
        **summary, "capacity": [surface.capacity for surface in surfaces],
        "rim_met": [yes(index + 1 in summary["rims_met"]) for index in range(len(surfaces))],
    }  # fmt: skip
    columns = {name: column for name, column in SURFACE_COLUMNS.items() if column[0] in values}
    rows = [
        (str(index + 1), *(format(values[key][index] * scale, style) for key, scale, style in columns.values()))
        for index in range(len(surfaces))
    ]
    return Table("surfaces, bottom first", ("surface", *columns), rows)


def transition_table(transitions: Mapping[str, float | None]) -> Table:
    """The stages of a monotonic run, as `summary` names them."""
    rows = []
    for key, value in transitions.items():
        kind = key.rstrip("0123456789")
        shown = "not met" if value is None else f"{value:.4f}" if kind == "F_dr" else f"{value * 1e3:.2f} mm"
        rows.append((SYMBOLS.get(key, key), shown, MEANINGS[kind].format(key.removeprefix(kind))))
    return Table("stages of motion (Table 4.2 of the report), F over the axial load", (), rows)


def _peaks(peaks: Mapping[str, float], scale: float) -> str:
    shown = {axis: value for axis, value in peaks.items() if axis != "E3"}
    return ", ".join(f"{axis} {value * scale:.4g}" for axis, value in shown.items())


def _speed(summary: Mapping[str, Any]) -> str:
    factor = summary["real_time_factor"]
    text = f"{summary['duration']:.6g} s in {summary['wall_time']:.3g} s"
    return text if factor is None else f"{text}, {factor:.4g} times real time"


def _energy(energy: Mapping[str, float | None]) -> str:
    if energy["closure_error"] is None:
        return "no work was done"
    return (f"balance closes to {energy['closure_error']:.2g} of the peak input {energy['peak_input']:.4g} J, "
            f"{energy['dissipated_share']:.1%} dissipated")  # fmt: skip
