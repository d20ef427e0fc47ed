"""Model error: what is lost where less is modelled, in the same measure as the error of the numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.accuracy.measure import best_reference
from msfp_gen.accuracy.methods import METHODS
from msfp_gen.accuracy.opensees import run_opensees
from msfp_gen.accuracy.series import run_series
from msfp_gen.accuracy.study import (
    LIMIT,
    Say,
    Study,
    affordable,
    check_settings,
    doubts,
    families,
    ladder,
    point_of,
    tighter,
    told,
    without_stop,
)
from msfp_gen.accuracy.trial import CUT_OFF, Trial, refused, run_native
from msfp_gen.errors import InputError, RunError
from msfp_gen.motion import Motion

if TYPE_CHECKING:
    from msfp_gen.scene import Scene

TOLERANCES = tuple(10.0**-k for k in range(2, 8))
STEPS = (250, 1000, 4000)  # of models without an error control
CONFIRMING = ("Radau", (1e-4, 1e-5))  # what confirms the reference: of all libraries the one that ends most often
Setting = float | int


@dataclass(frozen=True)
class Variant:
    """A model that leaves something out.

    stepped: it has no error control, and its settings are numbers of steps instead of tolerances.
    run: scene, setting, limit [s] -> Trial; raises InputError where the model does not apply.
    """

    name: str
    about: str
    run: Callable[[Scene, Any, float], Trial]
    stepped: bool = False


def _effects(name: str, about: str, **changes: Any) -> Variant:
    return Variant(name, about, partial(_with_effects, changes))


def _with_effects(changes: dict[str, Any], scene: Scene, rtol: float, limit: float) -> Trial:
    """The default method on the same scene with other effects."""
    now = scene.modelled
    if all(getattr(now, name) == value for name, value in changes.items()):
        raise InputError(f"the scene itself has {', '.join(f'{name} = {value!r}' for name, value in changes.items())}")
    effects = replace(now, **changes)
    if effects.dimension == "planar" and scene.motion.plane() is None:
        return _axis_by_axis(scene, effects, rtol, limit)
    return run_native("implicit", replace(scene, effects=effects), rtol, limit)


def _axis_by_axis(scene: Scene, effects: Any, rtol: float, limit: float) -> Trial:
    """A motion in no one plane, by a planar model for each horizontal axis, as if they knew nothing of each other."""
    one, two = (
        run_native("implicit", replace(scene, effects=effects, motion=_along(scene.motion, axis), motion_table=None),
                   rtol, limit)
        for axis in (0, 1)
    )  # fmt: skip
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
    """The motion with one horizontal channel only; vertical motion stays."""
    if np.any(motion.coefficients[:, 3:]):
        raise InputError("motion: a base that rocks about both axes has no planar parts; use the spatial model")
    coefficients = motion.coefficients.copy()
    coefficients[:, 1 - axis] = 0.0
    return replace(motion, coefficients=coefficients)


def _stepped(name: str, about: str, run: Callable[[Scene, int], Trial]) -> Variant:
    return Variant(name, about, lambda scene, steps, limit: run(scene, steps), stepped=True)


VARIANTS: tuple[Variant, ...] = (
    _effects("planar", "one vertical plane; a motion in two directions axis by axis", dimension="planar"),
    _effects("massless", "no inertia of the sliders", sliders="massless"),
    _effects("no rims", "nothing stops a slider", rims=False),
    _effects("planar massless", "both", dimension="planar", sliders="massless"),
    _stepped("linearised", "published closed form: springs, friction and gaps in series", run_series),
    _stepped("linearised, arms", "the same with friction at its true radius", partial(run_series, arms=True)),
    _stepped("OpenSees", "element TripleFrictionPendulum", run_opensees),
)


def model_errors(
    scene: Scene,
    *,
    tolerances: Sequence[float] = TOLERANCES,
    limit: float = LIMIT,
    say: Say = lambda line: None,
) -> Study:
    """Error against cost of the scene as it stands and of models that leave something out, all against the former.

    A model's error falls with its tolerance until what it leaves out is all that remains. Arguments and errors as
    those of `work_precision`.
    """
    check_settings(tolerances, limit)
    scene = without_stop(scene)
    full, _ = ladder(METHODS["implicit"], scene, sorted(tolerances, reverse=True), limit, say)
    name, confirming = CONFIRMING
    others, _ = ladder(METHODS[name], scene, confirming, limit, say)
    extra = [*others, *tighter(scene, full, limit, say), *affordable(scene, others, limit, say)]
    reference = best_reference([*full, *extra], families())
    points, notes = [point_of("as it stands", trial, reference) for trial in full], doubts(reference)
    for variant in VARIANTS:
        trials, why = _variant_trials(variant, scene, tolerances, limit, say)
        # Whether a tolerance is kept says nothing of a model that is not the scene's.
        points += [replace(point_of(variant.name, trial, reference), wrong=False) for trial in trials]
        notes += why
    return Study(scene, "model-error", tuple(points), reference, tuple(notes))


def _variant_trials(
    variant: Variant, scene: Scene, tolerances: Sequence[float], limit: float, say: Say
) -> tuple[list[Trial], list[str]]:
    """The runs of one variant, and why there are none or fewer."""
    trials: list[Trial] = []
    for setting in _step_counts(scene) if variant.stepped else sorted(tolerances, reverse=True):
        try:
            trial = replace(variant.run(scene, setting, limit), method=variant.name)
        except InputError as error:
            return [], [f"{variant.name}: left out; {error}"]
        except RunError as error:
            lost = refused(variant.name, scene.end / setting if variant.stepped else setting, scene, str(error))
            trial = replace(lost, status=error.status or "failed", stepped=variant.stepped)
        trials.append(trial)
        say(told(trial))
        if trial.status == CUT_OFF:
            return trials, [f"{variant.name}: cut off, so tighter than {setting:g} was not tried"]
    return trials, []


def _step_counts(scene: Scene) -> list[int]:
    """Numbers of steps; of a record one, two and four for each of its samples."""
    least = 1 if scene.motion.max_step is None else int(np.ceil(scene.end / scene.motion.max_step))
    return [least, 2 * least, 4 * least] if least > STEPS[1] else list(STEPS)
