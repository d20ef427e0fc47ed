"""Random states of random stacks, as the public classes and the compiled models take them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from reference import cases


def sensible(layout: tuple[int, int, int], seed: int) -> tuple[Any, ...]:
    """A random case whose heights fit its centroids, so that the public Bearing takes it."""
    values, state, h, load = cases.random_case(layout, seed)
    bodies = tuple(
        replace(
            b, centroid=min(b.centroid, 0.9 * b.height), inertia=(b.inertia[0], min(b.inertia[1], 1.9 * b.inertia[0]))
        )
        for b in values.bodies
    )
    return (
        replace(values, bodies=bodies, base_centroid=min(values.base_centroid or 1.0, 0.9 * values.base_height)),
        state,
        h,
        load,
    )


def inputs(state: Any, load: Any) -> dict[str, Any]:
    base = state.base
    return {
        "base_acceleration": base.acceleration,
        "top_force": load.force,
        "top_moment": load.moment,
        "base_rotation": (base.angles, base.rates, base.rate_rates),
    }
