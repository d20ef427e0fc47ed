"""`effect_by_effect`: changes, cost and verdicts are those of runs that a person would compare."""

from dataclasses import replace
from math import isfinite, nan

import numpy as np
import pytest
from support import ROOT

from msfp_gen import Limits, load_scene, simulate
from msfp_gen.common.errors import InputError
from msfp_gen.results.verdict import Limit, LimitReading, ReachedValue
from msfp_gen.scene.friction_parameters import bearing_for
from msfp_gen.scene.system import OtherSystem
from msfp_gen.specification.friction_laws import BUILT_IN, law_of
from msfp_gen.studies.accuracy.effect_by_effect import EffectRun, _change, _states, effect_by_effect, simpler_laws

SCENE = replace(load_scene("fenz-test2"), duration=4.0)


class Bare(OtherSystem):
    name = "bare"

    def start(self, **options):
        raise AssertionError(options)


def outcome(values, **limits):
    """A made-up run: two values of a quantity, and limits of 1 with what was reached."""
    readings = {
        name: LimitReading(Limit(name, name, "N", lambda *_: ()), 0, "", ReachedValue(0, None, reached, 1.0))
        for name, reached in limits.items()
    }
    return EffectRun({"a": np.array(values)}, readings, 1.0)


@pytest.mark.slow
def test_changes_are_differences_of_runs():
    study = effect_by_effect(SCENE, only=("sliders",))
    rows = {one.effect: one for one in study.changes}
    assert set(rows) == {"tolerance", "sliders"}
    tight = replace(SCENE, solver=replace(SCENE.solver, rtol=0.1 * SCENE.solver.rtol))
    others = {
        "tolerance": tight,
        "sliders": SCENE.with_effects(sliders=rows["sliders"].after),
    }
    base = simulate(SCENE).summary
    for effect, scene in others.items():
        summary = simulate(scene).summary
        for name in ("peak_force", "peak_displacement"):
            change = summary[name]["radial"] / base[name]["radial"] - 1
            assert rows[effect].changes[name] == pytest.approx(change, abs=1e-12), (effect, name)
        assert rows[effect].cost > 0
    assert abs(rows["sliders"].changes["peak_sliding"]) > 1e-6
    (table, _), shown = study.tables, study.error["peak_sliding"]
    assert f"±{100 * abs(shown):.2g} %" in table.text


def test_a_limit_at_the_value_is_undecided():
    reached = simulate(SCENE).summary["peak_displacement"]["radial"]
    study = effect_by_effect(replace(SCENE, limits=Limits(displacement=reached)), only=("sliders",))
    assert len(study.undecided) == 1 and "the limit lies within the numerical error" in study.tables[1].text


@pytest.mark.parametrize(("damping", "rings"), [(0.0, True), (1e-3, False)])
def test_a_numerical_error_without_the_ringing_says_so(damping, rings):
    study = effect_by_effect(replace(SCENE, bearing=SCENE.bearing.replace(contact_damping=damping)), only=("spin",))
    assert ("contact_damping" in study.tables[1].text) == rings


def test_limits_that_an_effect_crosses_are_named():
    noise = {"force": 0.1, "gap": 0.1}
    base = outcome([2.0, 4.0], force=0.5, gap=3.0)
    crossing = outcome([3.0, 4.2], force=1.5, gap=1.05)
    found = _change("rims", "on", "off", base, crossing, _states(base, noise), _states(crossing, noise))
    assert found.limits == {"force": "exceeded", "gap": "undecided"}
    assert found.decides == "force exceeded, gap undecided"
    assert found.changes == {"a": 0.25} and found.cost == 1.0
    alike = _change("rims", "on", "off", base, base, _states(base, noise), _states(base, noise))
    assert alike.decides == "same" and alike.changes == {"a": 0.0}
    lost = _change("rims", "on", "off", base, outcome([nan, 4.0]), {}, {})
    assert not isfinite(lost.changes["a"])
    at_limit = outcome([1.0], force=1.0 + 1e-12)  # as the verdict: within, by rounding
    assert not at_limit.limits["force"].exceeded and _states(at_limit, {}) == {"force": "within"}


def test_friction_is_simplified_by_what_a_law_takes():
    assert simpler_laws(BUILT_IN["pvt"]) == ["pv", "constant"]
    assert simpler_laws(BUILT_IN["pv"]) == simpler_laws(BUILT_IN["velocity"]) == ["constant"]
    assert simpler_laws(law_of("custom", "mu * (1 - c1 * exp(-c2 * v))")) == ["constant"] and simpler_laws(None) == []


def test_an_effect_that_cannot_act_says_why():
    scene = replace(load_scene("becker-circle-5"), duration=1.0)
    (row,) = (one for one in effect_by_effect(scene, only=("dimension",)).changes if one.effect == "dimension")
    assert (row.after, row.cost) == ("planar", None) and "spatial" in row.why
    with pytest.raises(InputError, match="bare: this system has no effects"):
        effect_by_effect(Bare())


def test_a_lost_friction_law_loses_its_numbers():
    scene = load_scene(str(ROOT / "examples" / "heating.toml"))
    without = scene.with_effects(friction="constant", friction_law=None)
    assert without.bearing == bearing_for(scene.bearing, "constant") != scene.bearing
    for before, after in zip(scene.bearing.surfaces, without.bearing.surfaces, strict=True):
        assert after.friction == before.friction and before.reference_pressure and after.reference_pressure is None
