"""Where sliders may be massless: figures of docs/effects.md. `python benchmarks/massless.py` takes about two minutes.

The first table has random slow tests of `auto_scenes.py` that quasi-static steps can do, run with massless sliders and
with all effects, by the response time of the sliders over error times the time scale of the motion: `Auto` permits
RESPONSE_SHARE. The second counts the random scenes that fail with massless sliders given, and how many of those
complete with inertia.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import astuple, replace
from itertools import pairwise
from time import perf_counter

import auto
import auto_scenes
import numpy as np
from quick import parser, pick

from msfp_gen import RunError, Scene, simulate
from msfp_gen.scene.effect_selection import (
    RESPONSE_SHARE,
    inertia_limit,
    inertia_share,
    minimum_load,
    motion_time_scale,
    quasistatic,
    response_time,
)

SLOW, SCENES = pick((200, 300), (3, 4))
BINS = (0.0, RESPONSE_SHARE, 2 * RESPONSE_SHARE, 4 * RESPONSE_SHARE, 8 * RESPONSE_SHARE, 32 * RESPONSE_SHARE)
LIMIT = 10.0  # [s] of wall time of one run with given sliders


def response_ratio(scene: Scene) -> float:
    """Response time of the sliders over error times the time scale of the motion [-]."""
    response = response_time(scene.bearing, scene.top, minimum_load(scene))
    return response / (auto.PROMISED * motion_time_scale(scene))


def massless(scene: Scene) -> Scene | None:
    """The scene with massless sliders given; None where quasi-static steps do not apply, or inertial forces count."""
    light = inertia_share(scene) <= inertia_limit(scene, auto.PROMISED)
    given = replace(scene, effects=replace(scene.effects, sliders="massless"))
    return given if light and quasistatic(given, given.modelled) else None


def response_table() -> Iterator[str]:
    """Rows of the first table."""
    found: list[tuple[float, tuple[float, ...]]] = []
    for scene in auto.drawn(auto_scenes.slow_test, auto.SEED, SLOW):
        if (given := massless(scene)) is not None:
            fewer = auto.run(given)
            every = auto.run(replace(scene, effects=auto.full(scene, fewer)))
            found.append((response_ratio(scene), astuple(auto.difference(fewer, every))))
    yield f"| response time | scenes | {auto.COLUMNS} |\n" + "|---" * 7 + "|"
    for low, high in pairwise(BINS):
        here = [values for ratio, values in found if low < ratio <= high]
        if here:
            yield f"| {low:g} to {high:g} | {len(here)} | {auto.percent(np.max(here, axis=0))} |"
    beyond = [ratio for ratio, values in found if max(values) > auto.PROMISED]
    yield f"\nLeast response time with a difference beyond {auto.PROMISED:.1%}: {min(beyond, default=np.nan):.2g}"


def status(scene: Scene) -> str:
    """How a run ends."""
    begin = perf_counter()

    def limited(reached: float, end: float) -> None:
        if perf_counter() - begin > LIMIT and reached < end:
            raise auto.OutOfTimeError

    try:
        return simulate(scene, progress=limited).status
    except RunError as error:
        return str(error.status)
    except auto.OutOfTimeError:
        return "time"


def failures() -> Iterator[str]:
    """Rows of the second table."""
    counts: Counter[tuple[str, str]] = Counter()
    for scene in auto.drawn(auto_scenes.scene, auto.SEED, SCENES):
        leaves = scene.effect_selection.plane_until < scene.end
        dimension = "spatial" if leaves else scene.modelled.dimension
        effects = replace(scene.modelled, dimension=dimension, rims=True)
        if effects.uplift:
            continue
        counts[scene.top.kind, "scenes"] += 1
        if status(replace(scene, effects=replace(effects, sliders="massless"))) != "ok":
            counts[scene.top.kind, "fail"] += 1
            inertial = replace(scene, effects=replace(effects, sliders="inertial"))
            counts[scene.top.kind, "complete with inertia"] += status(inertial) == "ok"
    yield "| top | scenes | fail | of these complete with inertia |\n|---|---|---|---|"
    for top in ("rig", "mass"):
        yield (
            f"| {top} | " + " | ".join(str(counts[top, w]) for w in ("scenes", "fail", "complete with inertia")) + " |"
        )


def main() -> None:
    """Print the tables."""
    parser(__doc__).parse_args()
    for table in (response_table, failures):
        print("\n".join(table()), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
