"""A second opinion on results of any program: `audit` checks time histories of a bearing against its data.

docs/audit.md describes columns, maps and checks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from msfp_gen.auditing.case import CONSISTENT, INCONSISTENT, OPEN, AuditCase, Finding
from msfp_gen.auditing.checks import CHECKS
from msfp_gen.auditing.columns import histories_from, read_histories
from msfp_gen.auditing.corrections import corrected
from msfp_gen.auditing.histories import Histories
from msfp_gen.auditing.implied import ImpliedRange, implied_figures, implied_ranges
from msfp_gen.auditing.stated import stated_of
from msfp_gen.common.tables import Table

__all__ = ["Audit", "Finding", "Histories", "audit", "read_histories"]


@dataclass(frozen=True, eq=False)
class Audit:
    """The findings of `audit`.

    Attributes:
        name: of the file or result.
        bearing: name of the bearing.
        findings: one for every check, in the order of `CHECKS`.
        coefficients: the range of the friction coefficient that the data imply, by speed, axial force and time.
        figures: the same, drawn over each of these.
    """

    name: str
    bearing: str
    findings: tuple[Finding, ...]
    coefficients: tuple[ImpliedRange, ...] = ()
    figures: tuple[Finding, ...] = field(default=(), repr=False)

    @property
    def inconsistent(self) -> tuple[Finding, ...]:
        """The findings that contradict the data of the bearing or mechanics."""
        return tuple(one for one in self.findings if one.verdict == INCONSISTENT)

    @property
    def text(self) -> str:
        """One line: what is inconsistent, and how many checks could not be decided."""
        open_ = sum(one.verdict == OPEN for one in self.findings)
        rest = f"; {open_} of {len(self.findings)} checks not decidable from these data" if open_ else ""
        if not self.inconsistent:
            return f"nothing inconsistent{rest}"
        return f"inconsistent: {', '.join(one.check for one in self.inconsistent)}{rest}"

    def finding(self, check: str) -> Finding:
        """The finding of a check by its key. Raises KeyError."""
        return {one.check: one for one in self.findings}[check]

    @property
    def tables(self) -> list[Table]:
        """Verdict, number and time of every check; coefficients; what was found, the inconsistent findings first."""
        rows = [
            (one.title, one.verdict.upper() if one.verdict == INCONSISTENT else one.verdict, _number(one), _place(one))
            for one in self.findings
        ]
        summary = Table(
            f"audit of {self.name} against {self.bearing}: {self.text}",
            ("check", "verdict", "number", "time [s]"),
            rows,
        )
        order = [INCONSISTENT, CONSISTENT, OPEN]
        said = sorted(self.findings, key=lambda one: order.index(one.verdict))
        head = ("by", "range", "rows", "median", "5 to 95 % of the rows", "law")
        implied = [Table("friction coefficient that the data imply", head, [one.cells for one in self.coefficients])]
        found = Table("what was found", (), [(one.check, one.sentence) for one in said])
        return [summary, *(implied if self.coefficients else []), found]

    @property
    def as_dict(self) -> dict[str, Any]:
        """The audit as plain data: name, bearing, text, findings, coefficients."""
        return {
            "name": self.name,
            "bearing": self.bearing,
            "text": self.text,
            "findings": [one.as_dict for one in self.findings],
            "coefficients": [one._asdict() for one in self.coefficients],
        }

    def page(self, path: str | Path) -> Path:
        """Write an HTML page with the evidence drawn. Raises InputError for a path that cannot be written."""
        from msfp_gen.auditing.page import audit_opinion, write_opinion

        return write_opinion(audit_opinion(self), path)


def _number(one: Finding) -> str:
    return "-" if one.value is None else f"{one.value:.4g} {one.unit}".rstrip()


def _place(one: Finding) -> str:
    return "-" if one.time is None else f"{one.time:.4g}"


def audit(source: Any, bearing: Any, columns: str | Path | Mapping[str, Any] | None = None) -> Audit:
    """Check time histories of a bearing, of any program, against the data of the bearing and against mechanics.

    Args:
        source: a file (text table, or a result .nc), a `Result`, or `Histories`.
        bearing: a `Bearing`, a `Scene`, or the file of a scene or data sheet.
        columns: the map of a text table, its path or its table; None: a CSV of this package.

    Raises InputError: a file, map or bearing that cannot be read, or times that do not increase.
    """
    stated = stated_of(bearing)
    given = histories_from(source, columns)
    data, found = corrected(given, stated)
    case = AuditCase(given, stated, data, found)
    findings = tuple(Finding(key, title, *check(case)) for key, (title, check) in CHECKS.items())
    coefficients = implied_ranges(case)
    return Audit(given.name, stated.name, findings, coefficients, implied_figures(case, coefficients))
