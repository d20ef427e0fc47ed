"""What a run to a wanted error came to, as tables for a person."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msfp_gen.tables import Table

if TYPE_CHECKING:
    from msfp_gen.accuracy.within import Attempt, Within


def within_tables(found: Within) -> list[Table]:
    """The error that was asked for, the estimated one, its cost and that of the next step up; why, where asked."""
    chosen, step = found.chosen, found.next_step
    rows = [
        ("asked for", share(found.target)),
        ("estimated error of this run", f"{share(chosen.estimate)}: {_parts(chosen)}"),
        *([("not in it", found.left_out)] if found.left_out else []),
        ("settings", f"{chosen.method}, rtol {chosen.rtol:g}"),
        ("its cost", f"{_seconds(chosen.seconds)}, {chosen.newton} Newton iterations; with the search "
                     f"{_seconds(found.seconds)}"),
        ("the next step up", _next(step, chosen)),
    ]  # fmt: skip
    tables = [Table("accuracy, relative to peaks", (), rows)]
    if found.explained:
        tables += [_attempts(found), Table("why", (), [("-", reason) for reason in found.reasons])]
    return tables


def share(value: float | None) -> str:
    """As a percentage with two digits."""
    return "not known" if value is None else f"{100 * value:.2g} %"


def _parts(attempt: Attempt) -> str:
    if attempt.errors is None:
        return "not judged"
    found = attempt.errors
    return (f"force {share(found.force_rms)} RMS, {share(found.force_peak)} at its peak; sliding "
            f"{share(found.sliding_rms)} RMS, {share(found.sliding_peak)} at its peak")  # fmt: skip


def _next(step: Attempt | None, chosen: Attempt) -> str:
    if step is None:
        return "none was found in the time given"
    better = (step.estimate or 1.0) < (chosen.estimate or 0.0)
    told = f"about {share(step.estimate)}" if better else "no better, as far as is known,"
    return f"rtol {step.rtol:g}: {told} in {_seconds(step.seconds)}"


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if value < 1 else f"{value:.3g} s"


def _attempts(found: Within) -> Table:
    columns = ("rtol", "outcome", "time", "Newton iterations", "estimated error")
    rows = [(f"{a.rtol:g}", a.status, _seconds(a.seconds), str(a.newton), share(a.estimate)) for a in found.attempts]
    return Table("what was tried, each judged by a tighter one", columns, rows)
