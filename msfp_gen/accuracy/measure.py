"""How far two runs are apart, and which of several runs may serve as the reference."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import combinations

import numpy as np

from msfp_gen.accuracy.trial import Trial
from msfp_gen.errors import InputError, RunError
from msfp_gen.history import Array

ERRORS = {
    "force_max": "top force, maximum",
    "force_rms": "top force, RMS",
    "sliding_max": "sliding, maximum",
    "sliding_rms": "sliding, RMS",
}


@dataclass(frozen=True)
class Errors:
    """What one run is off by: the horizontal force on the top over its peak, sliding over its largest on any surface.

    maximum: at the worst instant (and surface); rms: over time (at the worst surface); peak: of the peak alone,
    whenever it occurs. nan where a run does not tell sliding.
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
        """By name."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Reference:
    """The run that errors are measured against, the one that confirms it, and how far they are apart.

    Without a second run nothing confirms the first: `second` and `floor` are None. independent: the two are of
    different families of methods.
    """

    trial: Trial
    second: Trial | None
    floor: Errors | None
    independent: bool = True


def errors(trial: Trial, reference: Trial) -> Errors | None:
    """What `trial` is off by as far as it came; None where it left no rows."""
    rows = min(len(trial.force), len(reference.force))
    if not rows:
        return None
    force = np.linalg.norm(trial.force[:rows] - reference.force[:rows], axis=1)
    told = trial.sliding if trial.sliding.shape[1] else np.full((rows, 1), np.nan)
    sliding = np.abs(told[:rows] - reference.sliding[:rows])
    over_force, over_sliding = _peaks(reference)
    if not over_force or not over_sliding:
        raise InputError("scene: the bearing did not move, so there is nothing to be relative to; give it a motion")
    return Errors(
        float(force.max() / over_force),
        float(_rms(force) / over_force),
        float(sliding.max() / over_sliding),
        float(_rms(sliding).max() / over_sliding),
        abs(_peaks(trial)[0] / over_force - 1),
        abs(_peaks(trial)[1] / over_sliding - 1),
    )


def _peaks(trial: Trial) -> tuple[float, float]:
    sliding = float(trial.sliding.max()) if trial.sliding.size else float("nan")
    return float(np.linalg.norm(trial.force, axis=1).max()), sliding


def _rms(values: Array) -> Array:
    out: Array = np.sqrt(np.mean(np.square(values), axis=0))
    return out


def best_reference(trials: Iterable[Trial], families: dict[str, str]) -> Reference:
    """Of the tightest finished run of every method, the two of different families that agree best; the tighter leads.

    families: method -> family. Without two families two methods of one must do, or two tolerances of one method: then
    the floor is a lower bound, and `Reference.independent` is false. Raises RunError where no run finished.
    """
    finished = sorted((t for t in trials if t.finished), key=lambda t: t.rtol)
    if not finished:
        raise RunError("no run reached the end in the time given: raise the limit or shorten the scene", status="limit")
    tightest = list({trial.method: trial for trial in reversed(finished)}.values())
    pairs = list(combinations(sorted(tightest, key=lambda t: t.rtol), 2))
    apart = [pair for pair in pairs if families[pair[0].method] != families[pair[1].method]]
    chosen = apart or pairs or [(finished[0], second) for second in finished[1:2]]
    if not chosen:
        return Reference(finished[0], None, None, independent=False)
    floor, first, second = min(((_apart(*pair), *pair) for pair in chosen), key=lambda item: item[0].worst_rms)
    return Reference(first, second, floor, independent=bool(apart))


def _apart(first: Trial, second: Trial) -> Errors:
    found = errors(second, first)
    if found is None:
        raise RunError("a finished run left no rows", status="rows")
    return found
