"""Which effects a wanted error calls for: the one place where a choice of effects meets a choice of tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from msfp_gen.errors import InputError
from msfp_gen.layout import Auto, Effects

if TYPE_CHECKING:
    from msfp_gen.scene import Scene


def effects_for(scene: Scene, error: float) -> tuple[Effects | Auto, str]:
    """The effects to model for a relative `error`, and why, in words: the given ones, or chosen for half the error.

    The other half is left to the method.
    """
    asked = scene.effects
    if isinstance(asked, Effects):
        return asked, f"effects as the scene has them: {asked.dimension}, {asked.sliders} sliders"
    asked = replace(asked, error=min(asked.error, error / 2))
    reasons = replace(scene, effects=asked).choice.reasons
    return asked, "; ".join(f"{reason.effect} = {reason.chosen}: {reason.because}" for reason in reasons)


def full(scene: Scene) -> Scene:
    """The scene with everything modelled that a choice may have left out: it judges what that choice costs.

    A scene whose effects are given is its own judge: they are what was asked for.
    """
    if isinstance(scene.effects, Effects):
        return scene
    effects = replace(scene.modelled, dimension="spatial", sliders="inertial", rims=True)
    try:
        return replace(scene, effects=effects)
    except InputError:  # the bearing gives no rims
        return replace(scene, effects=replace(effects, rims=False))
