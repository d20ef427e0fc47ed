"""Tables of a run to a requested error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from msfp_gen.common.tables import Table

if TYPE_CHECKING:
    from msfp_gen.studies.accuracy.attempt import Attempt

AFTER_IMPACTS = ", and after impacts,"


def within_table(
    target: float, chosen: Attempt, step: Attempt | None, seconds: float, left_out: str, known: bool
) -> Table:
    """Requested and estimated error, settings and cost, and the cost of the next tighter tolerance.

    Args:
        target: requested error [-].
        chosen: the run.
        step: the next tighter tolerance; None if it was not run.
        seconds: wall time with the search [s].
        left_out: what the estimate does not include.
        known: whether what is left out is small enough for the estimate to be one of the true error.
    """
    estimate = f"{share(chosen.estimate)}: {_parts(chosen)}"
    rows = [
        ("requested error", share(target)),
        ("estimated error of this run", estimate if known else f"not known; without what is left out {estimate}"),
        *([("not in the estimate", left_out)] if left_out else []),
        ("settings", f"{chosen.method}, rtol {chosen.rtol:g}"),
        (
            "cost of this run",
            f"{_seconds(chosen.seconds)}, {chosen.newton} Newton iterations; with the search {_seconds(seconds)}",
        ),
        ("next tighter tolerance", _next(step, chosen)),
    ]
    return Table("accuracy, relative to peaks", (), rows)


def ringing_left_out(frequency: float, impact: bool) -> str:
    """What an estimate without the ringing of stuck sliders leaves out; frequency: of the slowest of them [Hz]."""
    return (
        f"the ringing of stuck sliders{AFTER_IMPACTS if impact else ''} at {frequency:.0f} Hz and above, which has no "
        "damping and is filtered: resolved on purpose it moved the force of other scenes by up to 1 % "
        "(docs/accuracy.md); give contact_damping"
    )


def attempt_table(attempts: Sequence[Attempt]) -> Table:
    """Every run of the search."""
    columns = ("rtol", "outcome", "time", "Newton iterations", "estimated error")
    rows = [(f"{a.rtol:g}", a.status, _seconds(a.seconds), str(a.newton), share(a.estimate)) for a in attempts]
    return Table("tolerances tried, each compared with a tighter one", columns, rows)


def reason_table(reasons: Sequence[str]) -> Table:
    """Why these settings were chosen."""
    return Table("reasons", (), [("-", reason) for reason in reasons])


def share(value: float | None) -> str:
    """`value` as a percentage with two digits."""
    return "not known" if value is None else f"{100 * value:.2g} %"


def _parts(attempt: Attempt) -> str:
    if attempt.errors is None:
        return "not estimated"
    found = attempt.errors
    return (
        f"force {share(found.force_rms)} RMS, {share(found.force_peak)} at its peak; sliding "
        f"{share(found.sliding_rms)} RMS, {share(found.sliding_peak)} at its peak"
    )


def _next(step: Attempt | None, chosen: Attempt) -> str:
    if step is None:
        return "not run in the time given"
    smaller = (step.estimate or 1.0) < (chosen.estimate or 0.0)
    error = f"about {share(step.estimate)}" if smaller else "no smaller estimate"
    return f"rtol {step.rtol:g}: {error} in {_seconds(step.seconds)}"


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if value < 1 else f"{value:.3g} s"
