"""One candidate tolerance in the search for a requested error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.studies.accuracy.measure import Errors


@dataclass(frozen=True)
class Attempt:
    """One run of the search: its settings, its cost and its estimated error.

    Attributes:
        method: name of the method.
        rtol: relative tolerance [-].
        seconds: wall time [s]; measured for the chosen run, else its iterations times the time per iteration of that.
        newton: Newton iterations.
        estimate: largest of the RMS and peak errors of force and sliding, relative to peaks [-], times a factor of
            safety; None if the run was compared with no other, or failed.
        errors: differences from the reference run; None as for `estimate`.
        status: how the run ended.
    """

    method: str
    rtol: float
    seconds: float
    newton: int
    estimate: float | None
    errors: Errors | None
    status: str
