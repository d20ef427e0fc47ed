"""Which effects a wanted error calls for: the one place where a choice of effects meets a choice of tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msfp_gen.layout import Effects
    from msfp_gen.scene import Scene


def effects_for(scene: Scene, error: float) -> tuple[Effects, str]:
    """The effects to model for a relative `error`, and why, in words."""
    return scene.effects, f"effects as the scene has them: {scene.effects.dimension}, {scene.effects.sliders} sliders"
