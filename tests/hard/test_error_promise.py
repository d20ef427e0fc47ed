"""What `--error` states is at least the true error: scenes of `benchmarks/promises.py` (docs/accuracy.md)."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import auto_scenes
import promises
import pytest
from promises import Outcome
from support import thinned

from msfp_gen import RunError, presets

KEPT = {14}  # a rig whose bearing heats
OWN = ("README.md", "docs/tutorial.md", "double.toml", "heating.toml", "quintuple.toml", "single.toml", "triple.toml")
FAST = {"README.md", "fenz-test2"}


@pytest.mark.parametrize("name", thinned((*OWN, *presets.names("scene")), lambda name: name in FAST))
def test_the_stated_error_of_presets_and_examples_holds(name: str) -> None:
    """Of README's scene, the examples and all presets, whose ringing is not damped."""
    scene = dict(chain(promises.own(), promises.all_presets()))[name]
    options = {} if name in OWN else promises.OF_PRESETS
    try:
        found = promises.promise(name, scene, **options)
    except RunError as error:
        assert name not in FAST and error.status == "accuracy", error
        return
    assert found.kept, found


@pytest.mark.slow
@pytest.mark.parametrize("name", ("hospital-clc", "hospital-ccc", *promises.VARIATIONS))
def test_the_stated_error_of_buildings_holds(name: str) -> None:
    """Displacement of bearings, base shear, floor accelerations and drifts, against all effects of the bearings."""
    found = promises.promise(name, dict(promises.buildings())[name], **promises.OF_BUILDINGS)
    assert found.kept and set(found.true.parts) == {"bearing_displacement", "base_shear", "floor_acceleration", "drift"}
    assert found.stated is not None and found.stated <= promises.TARGET, found


def test_all_scenes_of_ones_own_are_compared() -> None:
    assert tuple(name for name, _ in promises.own()) == OWN


@pytest.mark.slow
@pytest.mark.parametrize("number", range(40))
def test_the_campaign_is_within_what_is_said(number: int) -> None:
    """The stated error is true, and the run with default settings within the promise of `Auto` or noted."""
    found = promises.outcome(number)
    assert found.stated_is_true and (found.failed or found.kept or found.noted), found.row


def test_only_notes_of_accuracy_count_and_what_is_not_known_counts_nowhere() -> None:
    far = Outcome("far", 0.004, 0.003, default=0.02, notes=("heat",), floors=(1e-4, 1e-4))
    noted, unreached = (
        replace(far, notes=("heat", "vibration")),
        replace(far, stated=None, true=None, unreached="accuracy"),
    )
    untrue = replace(far, stated=0.001, default=0.001)
    assert promises.summary([far, noted, unreached, untrue, Outcome("none", failed="separated")]) == (
        "5 scenes, 1 without a reference run; of the other 4: 0.5% not reached in 1, not known in 0, stated in 3, "
        "true in 2; default run beyond 0.5% in 3, with a note of accuracy in 1"
    )
    assert "**beyond**" in far.row and "**beyond**" not in noted.row and "not reached" in unreached.row
    assert "**missed**" in untrue.row and "**missed**" not in far.row


@pytest.mark.slow
@pytest.mark.parametrize("number", range(promises.COUNT))
def test_the_stated_error_holds(number: int) -> None:
    """Against a run with all effects for which the scene has parameters; no error of a stack that comes apart."""
    scene = auto_scenes.demanding(promises.SEED, number)
    try:
        found = promises.promise(scene.name, scene)
    except RunError as error:
        assert number not in KEPT and error.status in ("accuracy", "separated"), error
        return
    assert found.kept, found
