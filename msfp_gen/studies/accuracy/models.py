"""Model error: the error of simplified models, in the same measure as the error of integration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.errors import InputError, RunError
from msfp_gen.motions.motion import Motion
from msfp_gen.studies.accuracy.methods import METHODS
from msfp_gen.studies.accuracy.series import run_opensees, run_series
from msfp_gen.studies.accuracy.study import (
    LIMIT,
    Say,
    Study,
    check_settings,
    confirming_reruns,
    families,
    point_of,
    reference_notes,
    run_tolerances,
    tighter_runs,
    trial_line,
    without_stop,
)
from msfp_gen.studies.accuracy.timed_run import CUT_OFF, Trial, best_reference, refused_trial, run_native

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene

TOLERANCES = tuple(10.0**-k for k in range(2, 8))
STEPS = (250, 1000, 4000)  # numbers of steps of models without error control
CONFIRMING = ("Radau", (1e-4, 1e-5))  # method and tolerances that confirm the reference: the most robust of SciPy's


@dataclass(frozen=True)
class Variant:
    """A simplified model.

    Attributes:
        name: as in tables and figures.
        about: one line of description.
        run: (scene, setting, limit of wall time [s]) -> Trial; raises InputError if the model does not apply.
        stepped: the model has no error control; its settings are numbers of steps instead of tolerances.
    """

    name: str
    about: str
    run: Callable[[Scene, Any, float], Trial]
    stepped: bool = False


def _effects(name: str, about: str, **changes: Any) -> Variant:
    return Variant(name, about, partial(_with_effects, changes))


def _with_effects(changes: dict[str, Any], scene: Scene, rtol: float, limit: float) -> Trial:
    """Run the scene by the default method with other effects."""
    current = scene.modelled
    if all(getattr(current, name) == value for name, value in changes.items()):
        raise InputError(f"the scene itself has {', '.join(f'{name} = {value!r}' for name, value in changes.items())}")
    effects = replace(current, **changes)
    if effects.dimension == "planar" and scene.motion.plane() is None:
        return _axis_by_axis(scene, effects, rtol, limit)
    return run_native("implicit", replace(scene, effects=effects), rtol, limit)


def _axis_by_axis(scene: Scene, effects: Any, rtol: float, limit: float) -> Trial:
    """Run a motion in two directions by one planar model for each horizontal axis, uncoupled, and combine them."""
    one, two = (
        run_native(
            "implicit",
            replace(scene, effects=effects, motion=_along(scene.motion, axis), motion_table=None),
            rtol,
            limit,
        )
        for axis in (0, 1)
    )
    worse = max(one, two, key=lambda t: not t.finished)
    rows = min(len(one.force), len(two.force))
    return replace(
        worse,
        seconds=one.seconds + two.seconds,
        newton=one.newton + two.newton,
        evaluations=one.evaluations + two.evaluations,
        steps=one.steps + two.steps,
        reached=min(one.reached, two.reached),
        force=np.column_stack([one.force[:rows, 0], two.force[:rows, 1]]),
        sliding=np.hypot(one.sliding[:rows], two.sliding[:rows]),
    )


def _along(motion: Motion, axis: int) -> Motion:
    """The motion with one horizontal channel only; vertical motion is kept."""
    if np.any(motion.coefficients[:, 3:]):
        raise InputError("motion: a base that rocks about both axes cannot be split by axis; use the spatial model")
    coefficients = motion.coefficients.copy()
    coefficients[:, 1 - axis] = 0.0
    return replace(motion, coefficients=coefficients)


def _stepped(name: str, about: str, run: Callable[[Scene, int], Trial]) -> Variant:
    return Variant(name, about, lambda scene, steps, limit: run(scene, steps), stepped=True)


VARIANTS: tuple[Variant, ...] = (
    _effects("planar", "one vertical plane; a motion in two directions is run axis by axis", dimension="planar"),
    _effects("massless", "no inertia of the sliders", sliders="massless"),
    _effects("no rims", "sliders travel beyond their capacity", rims=False),
    _effects("planar massless", "planar, and no inertia of the sliders", dimension="planar", sliders="massless"),
    _stepped("linearised", "published closed form: springs, friction and gaps in series", run_series),
    _stepped("linearised, arms", "the same with friction at the radius of its surface", partial(run_series, arms=True)),
    _stepped("OpenSees", "element TripleFrictionPendulum", run_opensees),
)


def model_errors(
    scene: Scene,
    *,
    tolerances: Sequence[float] = TOLERANCES,
    limit: float = LIMIT,
    say: Say = lambda line: None,
) -> Study:
    """Error against cost of the scene as given and of simplified models, all against a reference of the former.

    The error of a simplified model falls with its tolerance down to the error of the simplification. Arguments and
    exceptions are those of `work_precision`.
    """
    check_settings(tolerances, limit)
    scene = without_stop(scene)
    full, _ = run_tolerances(METHODS["implicit"], scene, sorted(tolerances, reverse=True), limit, say)
    name, confirming = CONFIRMING
    others, _ = run_tolerances(METHODS[name], scene, confirming, limit, say)
    extra = [*others, *tighter_runs(scene, full, limit, say), *confirming_reruns(scene, others, limit, say)]
    reference = best_reference([*full, *extra], families())
    points, notes = [point_of("as it stands", trial, reference) for trial in full], reference_notes(reference)
    for variant in VARIANTS:
        trials, left_out = _variant_trials(variant, scene, tolerances, limit, say)
        # A simplified model may miss its tolerance by its model error, which is no wrong success.
        points += [replace(point_of(variant.name, trial, reference), wrong=False) for trial in trials]
        notes += left_out
    return Study(scene, "model-error", tuple(points), reference, tuple(notes))


def _variant_trials(
    variant: Variant, scene: Scene, tolerances: Sequence[float], limit: float, say: Say
) -> tuple[list[Trial], list[str]]:
    """The runs of one variant, and notes on settings that were not run."""
    trials: list[Trial] = []
    for setting in _step_counts(scene) if variant.stepped else sorted(tolerances, reverse=True):
        try:
            trial = replace(variant.run(scene, setting, limit), method=variant.name)
        except InputError as error:
            return [], [f"{variant.name}: left out; {error}"]
        except RunError as error:
            failed = refused_trial(variant.name, scene.end / setting if variant.stepped else setting, scene, str(error))
            trial = replace(failed, status=error.status or "failed", stepped=variant.stepped)
        trials.append(trial)
        say(trial_line(trial))
        if trial.status == CUT_OFF:
            return trials, [f"{variant.name}: cut off, so tighter than {setting:g} was not tried"]
    return trials, []


def _step_counts(scene: Scene) -> list[int]:
    """Numbers of steps: STEPS, or one, two and four per sampling interval of a long record."""
    least = 1 if scene.motion.max_step is None else int(np.ceil(scene.end / scene.motion.max_step))
    return [least, 2 * least, 4 * least] if least > STEPS[1] else list(STEPS)
