"""Auto against all effects: the tables of docs/effects.md. `python benchmarks/auto.py` takes about a minute.

Scenes: those of `promises.py` with the default contact damping, the tutorial's bearing and a motion that leaves its
plane; fifty random scenes and fifty random slow tests of `auto_scenes.py`. Each is run at one tight tolerance with the
effects that Auto selects and with all effects. Differences: of the horizontal force on the top, RMS over time and of its
peak, over the friction force (largest coefficient times load at rest); of the peak displacement of the top, of the peak
sliding and of the least gap of every surface, over the largest sliding displacement. Floor: the largest of these
differences of two runs with all effects by two families of methods.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, dataclass, replace
from itertools import islice, pairwise
from pathlib import Path
from time import thread_time

import auto_scenes
import numpy as np
import promises
from quick import parser, pick

from msfp_gen import Auto, Effects, RunError, Scene, load_scene, simulate
from msfp_gen.results.result import Result
from msfp_gen.scene.effect_selection import load_at_rest
from msfp_gen.scene.effect_switching import all_effects
from msfp_gen.scene.file.loader import scene_from_table

ROWS = 4000
TOLERANCE = 1e-6
PROMISED = 0.005
LIMIT = 30.0  # [s] of the processor, of one run
SEED, COUNT = 21, pick(50, 2)
TUTORIAL = Path(__file__).resolve().parents[1] / "docs" / "tutorial.md"
COLUMNS = "force, RMS | peak force | displacement | sliding | least gap"


@dataclass(frozen=True)
class Difference:
    """Of two runs: of the force over the friction force [-], of displacements over the largest sliding [-]."""

    force_rms: float
    force_peak: float
    displacement_peak: float
    sliding_peak: float
    gap: float


@dataclass(frozen=True)
class Comparison:
    """Auto and all effects on one scene.

    models: of the run of Auto, in their order. floor: nan where the second run with all effects ended early.
    """

    name: str
    models: tuple[str, ...]
    difference: Difference
    floor: float

    @property
    def kept(self) -> bool:
        """Whether no difference exceeds what Auto promises, or what the two families of methods differ by."""
        return max(astuple(self.difference)) <= max(PROMISED, 0.0 if np.isnan(self.floor) else self.floor)


class OutOfTimeError(Exception):
    """A run took longer than LIMIT."""


def run(scene: Scene, method: str = "implicit") -> Result:
    """A run at the tight tolerance, with rows at even times."""
    begin = thread_time()  # of the processor, so that a busy machine changes nothing

    def limited(reached: float, end: float) -> None:
        if thread_time() - begin > LIMIT and reached < end:
            raise OutOfTimeError

    solver = replace(scene.solver, method=method, rtol=TOLERANCE, atol_angle=None)
    return simulate(replace(scene, solver=solver, output_step=scene.end / ROWS), progress=limited)


def full(scene: Scene, auto: Result) -> Effects:
    """All effects that Auto may leave out; separation where the run of Auto had it at its end."""
    uplift = "-uplift" in auto.provenance["model"].split(", then ")[-1]
    return replace(all_effects(scene), uplift=uplift)


def difference(one: Result, reference: Result) -> Difference:
    """Of two runs of the same scene, over the friction force and the largest sliding displacement of `reference`."""
    scene, a, b = one.scene, one.extremes, reference.extremes
    friction = max(surface.friction for surface in scene.bearing.surfaces) * load_at_rest(scene)
    force = np.linalg.norm(one.history.top_force[:, :2] - reference.history.top_force[:, :2], axis=1)
    slid = float(b.sliding.max())
    return Difference(
        float(np.sqrt(np.mean(force**2))) / friction,
        abs(float(a.top_force[3] - b.top_force[3])) / friction,
        abs(float(a.displacement[3] - b.displacement[3])) / slid,
        float(np.abs(a.sliding - b.sliding).max()) / slid,
        float(np.abs(a.gap - b.gap).max()) / slid,
    )


def compare(scene: Scene) -> Comparison:
    """Runs of one scene, compared. Raises RunError where a run ends early, OutOfTimeError where it takes too long."""
    fewer = run(scene)
    every = replace(scene, effects=full(scene, fewer))
    all_effects = run(every)
    try:
        floor = max(astuple(difference(run(every, "esdirk4"), all_effects)))
    except (RunError, OutOfTimeError):
        floor = float("nan")
    models = tuple(fewer.provenance["model"].split(", then "))
    return Comparison(scene.name, models, difference(fewer, all_effects), floor)


def edges(count: int) -> Iterator[tuple[str, str, str]]:
    """Name, models and agreement of tests whose sliders stand on their edges; where both runs end early, when."""
    for number in range(count):
        scene = auto_scenes.on_edge(SEED, number)
        try:
            found = compare(scene)
        except RunError as error:
            when, end = parted(scene)
            assert error.result is not None
            models = error.result.provenance["model"]
            yield scene.name, words(models.split(", then ")), f"come apart at {when:.4f} s, {end:.4f} s"
            continue
        worst = max(astuple(found.difference))
        yield scene.name, words(found.models), f"{100 * worst:.2f} %{'' if found.kept else ' **missed**'}"


def parted(scene: Scene) -> tuple[float, float]:
    """Times at which a scene comes apart with the effects of Auto, and with all [s]; inf: it does not."""
    times = []
    for tried in (scene, replace(scene, effects=replace(all_effects(scene), uplift=True))):
        try:
            run(tried)
            times.append(float("inf"))
        except RunError as error:
            assert error.result is not None
            times.append(float(error.result.history.time[-1]))
    return times[0], times[1]


def named() -> Iterator[Scene]:
    """The scenes of `promises.py` with the default contact damping, and two more; effects are left to Auto."""
    for name, scene in promises.scenes():
        given = scene.effects if isinstance(scene.effects, Effects) else scene.modelled
        bearing = scene.bearing.replace(contact_damping=1e-4)
        effects = Auto(bouc_wen=given.bouc_wen)
        yield replace(scene, name=name, bearing=bearing, effects=effects, output_step=None)
    table = tomllib.loads(TUTORIAL.read_text(encoding="utf-8").split("```toml")[1].split("```")[0])
    yield replace(scene_from_table(table | {"effects": "auto"}), name="bearing of the tutorial", output_step=None)
    test = load_scene("fenz-test2")
    motion, bearing = auto_scenes.leaving(0.08, 0.01), test.bearing.replace(contact_damping=1e-4)
    yield replace(test, name="leaves its plane", motion=motion, duration=None, bearing=bearing, effects=Auto())


def drawn(kind: Callable[[int, int], Scene], seed: int, count: int) -> Iterator[Scene]:
    """The first random scenes of a kind."""
    return (kind(seed, number) for number in range(count))


def compared(scenes: Iterable[Scene]) -> Iterator[Comparison]:
    """The comparison of each scene; a scene without one is printed with its reason."""
    for scene in scenes:
        try:
            yield compare(scene)
        except RunError as error:
            print(f"{scene.name}: {error.status}: {str(error)[:100]}\n")
        except OutOfTimeError:
            print(f"{scene.name}: out of time\n")


def words(models: tuple[str, ...]) -> str:
    """The selected effects, in short: those of the first model, and what later ones added."""
    found: list[list[str]] = []
    for key in models:
        _, dimension, _, sliders, *others = key.split("-")
        found.append([dimension, sliders, *(word for word in others if word in ("norims", "uplift", "pv", "pvt"))])
    added = [[word for word in b if word not in a] for a, b in pairwise(found)]
    return ", then ".join(" ".join(each) for each in [found[0], *added])


def left_out(comparison: Comparison) -> str:
    """What the run of Auto left out, in whole or in part."""
    first, last = comparison.models[0], comparison.models[-1]
    parts = {
        "plane": "-planar-" in first,
        "inertia": "-massless-" in first,
        "rims": "-norims-" in first,
        "temperature": "-pv" in first and "-pvt" not in first,
        "uplift, taken in during the run": "-uplift" in last and "-uplift" not in first,
    }
    return ", ".join(name for name, out in parts.items() if out) or "nothing"


def percent(values: Iterable[float]) -> str:
    """Cells of a table."""
    return " | ".join("-" if np.isnan(value) else f"{100 * value:.2f} %" for value in values)


def scene_table(found: Iterable[Comparison]) -> Iterator[str]:
    """One row for each scene whose floor is at most a tenth of the promise; those beyond the promise are marked."""
    yield f"| scene | modelled | {COLUMNS} | floor |\n" + "|---" * 8 + "|"
    unknown = []
    for each in found:
        if not each.floor <= 0.1 * PROMISED:
            unknown.append(each.name)
            continue
        mark = "" if each.kept else " **beyond**"
        values = percent((*astuple(each.difference), each.floor))
        yield f"| {each.name}{mark} | {words(each.models)} | {values} |"
    if unknown:
        yield f"\nLeft out, since the floor is more than {0.1 * PROMISED:.2%}: {'; '.join(unknown)}"


def summary_table(found: Iterable[Comparison]) -> Iterator[str]:
    """One row for each combination of effects left out: number of scenes, and the largest of every difference."""
    groups: dict[str, list[Comparison]] = {}
    for each in found:
        groups.setdefault(left_out(each), []).append(each)
    yield f"| left out | scenes | {COLUMNS} | beyond |\n" + "|---" * 8 + "|"
    for name, group in sorted(groups.items(), key=lambda item: -len(item[1])):
        worst = np.max([astuple(each.difference) for each in group], axis=0)
        beyond = ", ".join(each.name for each in group if not each.kept) or "-"
        yield f"| {name} | {len(group)} | {percent(worst)} | {beyond} |"


def main() -> None:
    """Print the tables."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=COUNT, help="number of random scenes, and of slow tests")
    options.add_argument("--seed", type=int, default=SEED)
    options.add_argument("--rows", action="store_true", help="one row for each random scene")
    given = options.parse_args()
    table = scene_table if given.rows else summary_table
    parts = [(scene_table, islice(named(), pick(None, 2)))]
    parts += [(table, drawn(kind, given.seed, given.count)) for kind in auto_scenes.KINDS]
    for make, scenes in parts:
        print("\n".join(make(compared(scenes))), end="\n\n", flush=True)
    print("| scene | modelled | largest difference |\n|---|---|---|")
    for row in edges(pick(16, 2)):
        print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
