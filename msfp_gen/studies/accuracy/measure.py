"""Error measures between two runs, and the choice of the reference run among several."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import combinations

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.errors import InputError, RunError
from msfp_gen.studies.accuracy.trial import Trial

ERRORS = {
    "force_max": "top force, maximum",
    "force_rms": "top force, RMS",
    "sliding_max": "sliding, maximum",
    "sliding_rms": "sliding, RMS",
}


@dataclass(frozen=True)
class Errors:
    """Errors of one run [-]: of the horizontal top force over its peak, of sliding over its largest on any surface.

    Attributes:
        force_max, sliding_max: at the worst instant (and surface).
        force_rms, sliding_rms: RMS over time (of the worst surface).
        force_peak, sliding_peak: of the peak value alone, whenever it occurs.

    Errors of sliding are NaN for a run that does not give sliding displacements.
    """

    force_max: float
    force_rms: float
    sliding_max: float
    sliding_rms: float
    force_peak: float
    sliding_peak: float

    @property
    def worst_rms(self) -> float:
        """The larger of the two RMS errors."""
        return float(np.fmax(self.force_rms, self.sliding_rms))

    def as_dict(self) -> dict[str, float]:
        """Name -> error."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Reference:
    """The run that errors are measured against, and the run that confirms it.

    Attributes:
        trial: the reference run.
        second: the confirming run; None if there is none.
        floor: difference of the two runs, below which errors are not known; None without a second run.
        independent: whether the two runs use different families of methods.
    """

    trial: Trial
    second: Trial | None
    floor: Errors | None
    independent: bool = True


def errors(trial: Trial, reference: Trial) -> Errors | None:
    """Errors of `trial` against `reference` over the rows that both have; None if `trial` has no rows.

    Raises InputError if the reference has no force or no sliding to be relative to.
    """
    rows = min(len(trial.force), len(reference.force))
    if not rows:
        return None
    force = np.linalg.norm(trial.force[:rows] - reference.force[:rows], axis=1)
    computed = trial.sliding if trial.sliding.shape[1] else np.full((rows, 1), np.nan)
    sliding = np.abs(computed[:rows] - reference.sliding[:rows])
    peak_force, peak_sliding = _peaks(reference)
    if not peak_force or not peak_sliding:
        raise InputError("scene: the bearing did not move, so relative errors are not defined; give it a motion")
    return Errors(
        float(force.max() / peak_force),
        float(_rms(force) / peak_force),
        float(sliding.max() / peak_sliding),
        float(_rms(sliding).max() / peak_sliding),
        abs(_peaks(trial)[0] / peak_force - 1),
        abs(_peaks(trial)[1] / peak_sliding - 1),
    )


def largest_error(found: Errors) -> float:
    """The error that a target bounds: the largest of the RMS and peak errors of force and sliding, relative [-]."""
    return max(found.force_rms, found.sliding_rms, found.force_peak, found.sliding_peak)


def _peaks(trial: Trial) -> tuple[float, float]:
    """Peak horizontal force [N] and largest sliding displacement [m]; NaN for sliding that a run does not give."""
    sliding = float(trial.sliding.max()) if trial.sliding.size else float("nan")
    return float(np.linalg.norm(trial.force, axis=1).max()), sliding


def _rms(values: Array) -> Array:
    out: Array = np.sqrt(np.mean(np.square(values), axis=0))
    return out


def best_reference(trials: Iterable[Trial], families: dict[str, str]) -> Reference:
    """The pair of runs that agree best, among the tightest finished run of each method; the tighter is the reference.

    Pairs of different families are preferred. Without such a pair, two methods of one family or two tolerances of one
    method are used: the floor is then a lower bound, and `Reference.independent` is false.

    Args:
        trials: runs of one scene.
        families: method -> family.

    Raises:
        RunError: no run finished.
    """
    finished = sorted((t for t in trials if t.finished), key=lambda t: t.rtol)
    if not finished:
        raise RunError("no run reached the end in the time given: raise the limit or shorten the scene", status="limit")
    tightest = list({trial.method: trial for trial in reversed(finished)}.values())
    pairs = list(combinations(sorted(tightest, key=lambda t: t.rtol), 2))
    independent = [pair for pair in pairs if families[pair[0].method] != families[pair[1].method]]
    candidates = independent or pairs or [(finished[0], second) for second in finished[1:2]]
    if not candidates:
        return Reference(finished[0], None, None, independent=False)
    floor, first, second = min(((_difference(*pair), *pair) for pair in candidates), key=lambda item: item[0].worst_rms)
    return Reference(first, second, floor, independent=bool(independent))


def _difference(first: Trial, second: Trial) -> Errors:
    """Errors of `second` against `first`, both finished."""
    found = errors(second, first)
    if found is None:
        raise RunError("a finished run has no rows", status="rows")
    return found
