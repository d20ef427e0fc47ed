"""Effects to model for a requested error: half of the error is left to effect selection, half to the method."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msfp_gen.scene.effect_switching import all_effects
from msfp_gen.specification.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene.scene import Scene


def effects_for(scene: Scene, error: float) -> tuple[Effects | Auto, str]:
    """Effects for a run with relative error `error` [-], and the reasons in words.

    Effects that the scene gives are kept. With effect selection (`Auto`), they are selected for half of `error`; the
    other half is left to the method.
    """
    effects = scene.effects
    if isinstance(effects, Effects):
        return effects, f"effects as the scene has them: {effects.dimension}, {effects.sliders} sliders"
    effects = replace(effects, error=min(effects.error, error / 2))
    reasons = replace(scene, effects=effects).effect_selection.reasons
    return effects, "; ".join(f"{reason.effect} = {reason.chosen}: {reason.because}" for reason in reasons)


def with_all_effects(scene: Scene) -> Scene:
    """The scene with every effect that it has parameters for and does not fix, to measure the error of a selection.

    A scene whose effects are given (`Effects`) is returned unchanged.
    """
    if isinstance(scene.effects, Effects):
        return scene
    return replace(scene, effects=all_effects(scene))
