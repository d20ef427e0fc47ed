"""A two-port is a pure function of committed state and trial; its tangent; its snapshots; its errors."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import Array, thinned
from support.ends import BEARING, INTERFACE, LOAD, STILL, advance, port, swing

from msfp_gen import Effects, InputError, Motion, RunError, Scene, Solver, Top, TwoPort, load_scene
from msfp_gen.embedding.unit import scene_of_unit
from msfp_gen.scene.scene_fields import Stop

STEP = 0.01  # [s]


def test_a_trial_depends_on_committed_state_and_ends_alone():
    """Trials in any order, with failures, reverts and tangents in between, give the same bits."""
    one, two = port(), port()
    advance(one, 0, 30, STEP)
    time = 31 * STEP
    end = swing(time)
    first = one.trial(time, *end).wrench
    for i in range(30):
        two.trial((i + 1) * STEP, *(1.3 * swing((i + 1) * STEP)))
        assert two.trial((i + 1) * STEP, *swing((i + 1) * STEP)).tangent.any()
        two.commit()
    two.trial(time, *(0.5 * end))
    with pytest.raises(RunError):
        two.trial(time, end[0], end[1] + [[0, 0, 0.1, 0, 0, 0]] * 3)
    two.trial(time + 0.3, *end)
    two.revert()
    assert np.array_equal(two.trial(time, *end).wrench, first)
    assert np.array_equal(two.trial(time, *end).wrench, first)


def test_small_commits_tend_to_one_large_one():
    """The committed path matters only as a path: pieces of one polynomial and the whole of it agree."""
    amplitude = 0.2 * np.array([[0.0] * 6, [0.02, 0.01, 0.0, 0.0, 0.0, 0.0]])

    def ramp(x: float, span: float) -> Array:
        rise = [10 * x**3 - 15 * x**4 + 6 * x**5, (30 * x**2 - 60 * x**3 + 30 * x**4) / span]
        return np.stack([amplitude * r for r in (*rise, (60 * x - 180 * x**2 + 120 * x**3) / span**2)], axis=1)

    whole, pieces = port(1e-6), port(1e-6)
    expected = whole.trial(0.2, *ramp(1.0, 0.2)).wrench
    for i in range(1, 21):
        found = pieces.trial(0.01 * i, *ramp(i / 20, 0.2)).wrench
        pieces.commit()
    assert found == pytest.approx(expected, abs=1e-4 * LOAD)


# Effects of a model, tolerance and step of the trial, and how far its derivatives by displacements, rates and
# accelerations are from differences, over the largest entry: what the tolerance of Newton's method leaves in these.
SMOOTH: list[tuple[dict[str, object], float, float, tuple[float, float, float]]] = [
    ({}, 1e-8, 5e-5, (1e-8, 1e-8, 1e-7)),
    ({"uplift": True}, 1e-8, 5e-5, (5e-7, 5e-7, 2e-5)),
    ({"friction": "pvt", "bouc_wen": "plastic"}, 1e-7, 1e-4, (1e-7, 1e-7, 1e-6)),
    ({"sliders": "massless"}, 1e-7, 1e-4, (1e-7, 1e-7, 1e-5)),
]
HOT = BEARING.replace(reference_pressure=15e6, patch_radius=0.025, velocity_rate=100.0)


def differences(two_port: TwoPort, time: float, end: Array, order: int) -> Array:
    """Richardson's differences of the wrenches with respect to derivative `order` of the motion of the ends."""
    expected = np.empty((12, 12))
    for column, (side, freedom) in enumerate(np.ndindex(2, 6)):
        size = (4e-6 if freedom > 2 else 2e-6) * (1.0, 5.0, 50.0)[order] / STEP**order
        moves = np.array([size, -size, size / 2, -size / 2])
        wrenches = []
        for move in moves:
            moved = end.copy()
            moved[side, order, freedom] += move
            wrenches.append(two_port.trial(time, *moved).wrench.ravel())
        coarse, fine = ((wrenches[i] - wrenches[i + 1]) / (2 * moves[i]) for i in (0, 2))
        expected[:, column] = (4 * fine - coarse) / 3
    return expected


@pytest.mark.parametrize(
    ("effects", "rtol", "step", "accuracies"), thinned(SMOOTH, lambda effects, *_: "sliders" not in effects), ids=str
)
def test_derivatives_equal_differences_of_trials(
    effects: dict[str, object], rtol: float, step: float, accuracies: tuple[float, float, float]
):
    """In steps that all have the longest length trials are smooth. Rows and columns of rotation count over 0.5 m."""
    bearing = HOT if "friction" in effects else BEARING
    two_port = port(rtol, bearing, Effects(**effects), max_step=step)  # type: ignore[arg-type]
    advance(two_port, 0, 12, 0.05)
    time = 0.61
    end = swing(time)
    response = two_port.trial(time, *end)
    found = {name: getattr(response, name) for name in ("tangent", "damping", "inertia")}
    arms = np.tile(np.repeat([1.0, 2.0], 3), 2)
    for order, (name, accuracy) in enumerate(zip(found, accuracies, strict=True)):
        expected = arms[:, None] * differences(two_port, time, end, order) * arms
        error = arms[:, None] * found[name] * arms - expected
        assert np.abs(error).max() < accuracy * np.abs(expected).max(), name


def test_the_effective_stiffness_is_the_sum_of_the_derivatives():
    two_port = port(1e-9)
    advance(two_port, 0, 12, 0.05)
    response = two_port.trial(0.61, *swing(0.61))
    factors = 2 / STEP, 4 / STEP**2
    expected = response.tangent + factors[0] * response.damping + factors[1] * response.inertia
    found = response.effective_stiffness(*factors)
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
    with pytest.raises(InputError, match="rate = nan"):
        response.effective_stiffness(np.nan, 1.0)


def test_a_newton_iteration_with_the_tangent_converges_quadratically():
    """A node under a force is found in few iterations, with steps and displacements as in Newmark's method."""
    two_port = port()
    advance(two_port, 0, 30, STEP)
    time, beta, gamma, mass = 31 * STEP, 0.25, 0.5, 11e3
    lower, node = swing(time)
    start = node.copy()
    target = swing(time)[1, 0, 0] + 1e-3  # a force that moves it by about 1 mm
    push = mass * target / (beta * STEP**2)
    errors = []
    for _ in range(6):
        response = two_port.trial(time, lower, node)
        residual = push - mass * node[0, 0] / (beta * STEP**2) - response.wrench[1, 0]
        errors.append(abs(residual))
        factors = gamma / (beta * STEP), 1 / (beta * STEP**2)
        change = residual / (response.effective_stiffness(*factors)[6, 6] + mass * factors[1])
        node[:, 0] += change * np.array([1.0, *factors])
    assert abs(node[0, 0] - start[0, 0]) > 1e-4
    assert errors[3] < 1e-6 * errors[0]


def test_a_snapshot_goes_on_in_a_new_process(tmp_path: Path):
    two_port = port()
    advance(two_port, 0, 20, STEP)
    (tmp_path / "snapshot").write_bytes(two_port.snapshot())
    expected = advance(two_port, 20, 40, STEP)
    code = (
        "import sys; from pathlib import Path; import numpy as np; from support.ends import advance, port\n"
        "two_port = port(); folder = Path(sys.argv[1]); two_port.restore((folder / 'snapshot').read_bytes())\n"
        f"np.save(folder / 'found.npy', advance(two_port, 20, 40, {STEP}))\n"
    )
    environment = {**os.environ, "PYTHONPATH": ":".join([str(Path(__file__).parents[2]), *sys.path])}
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True, env=environment)
    assert np.array_equal(np.load(tmp_path / "found.npy"), expected)
    two_port.restore((tmp_path / "snapshot").read_bytes())
    assert two_port.time == pytest.approx(20 * STEP) and np.array_equal(advance(two_port, 20, 40, STEP), expected)


def test_a_snapshot_of_something_else_is_refused():
    two_port = port()
    advance(two_port, 0, 3, STEP)
    good, last = two_port.snapshot(), two_port.trial(4 * STEP, *swing(4 * STEP)).wrench
    other = TwoPort(BEARING, INTERFACE, 1.01 * LOAD)
    for given, word in (
        (b"", "no bytes of TwoPort.snapshot"),
        (good[:-1], "damaged"),
        (good[:200] + b"!" + good[201:], "damaged"),
        (other.snapshot(), "other values"),
        ("text", "no bytes"),
    ):
        with pytest.raises(InputError, match=word):
            two_port.restore(given)  # type: ignore[arg-type]
    assert np.array_equal(two_port.trial(4 * STEP, *swing(4 * STEP)).wrench, last)


def test_at_the_committed_time_the_committed_wrench_is_given():
    two_port = port()
    weight = BEARING.gravity * sum(body.mass for body in BEARING.bodies)
    wrench = two_port.trial(0.0, STILL, STILL).wrench
    assert wrench[:, 2] == pytest.approx([LOAD + weight, -LOAD]) and np.abs(wrench[:, [0, 1, 3, 4, 5]]).max() < 1e-6
    last = advance(two_port, 0, 3, STEP)[-1]
    response = two_port.trial(two_port.time, *swing(two_port.time))
    assert np.array_equal(response.wrench, last)
    with pytest.raises(InputError, match="no time has passed"):
        _ = response.tangent


@pytest.mark.parametrize(
    "time, lower, upper, word",
    [
        (0.02, STILL, STILL, "time = 0.02: the committed state is at 0.03"),
        (0.03, STILL, STILL, "time = 0.03: the committed state has this time"),
        (0.03 + 1e-10, STILL, STILL, "give a later time"),
        (np.nan, STILL, STILL, "time = nan"),
        ("1", STILL, STILL, "time = '1'"),
        (0.04, np.zeros(6), STILL, "lower has shape"),
        (0.04, STILL, np.full((3, 6), np.inf), "upper has an entry that is not finite"),
        (0.04, STILL, [[0, 0, 0, 1.2, 1.2, 0], [0] * 6, [0] * 6], "upper.*a rotation of 1.697"),
    ],
)
def test_a_wrong_trial_is_named(time: float, lower: Array, upper: Array, word: str):
    two_port = port()
    advance(two_port, 0, 3, STEP)
    with pytest.raises(InputError, match=word):
        two_port.trial(time, lower, upper)


def test_a_failed_trial_is_named_and_leaves_the_committed_state():
    two_port = port()
    advance(two_port, 0, 3, STEP)
    before = two_port.snapshot()
    lifted = swing(4 * STEP)
    lifted[1, 0, 2] += 0.02  # 20 mm of 5e7 N/m: more than the load
    where = r"two-port: stopped at t = 0\.03\d* s of 0\.04 s"
    with pytest.raises(RunError, match=f"{where}.*uplift is not modelled") as error:
        two_port.trial(4 * STEP, *lifted)
    assert error.value.status == "uplift" and two_port.snapshot() == before
    with pytest.raises(InputError, match="commit: no trial"):
        two_port.commit()


def test_an_old_response_has_no_tangent():
    two_port = port()
    response = two_port.trial(STEP, *swing(STEP))
    kept = two_port.trial(STEP, *swing(STEP))
    assert kept.tangent.shape == (12, 12)
    two_port.commit()
    assert kept.tangent.shape == (12, 12)  # computed before
    for old in (response, kept):
        with pytest.raises(InputError, match="damping: this trial is not the latest;"):
            _ = old.damping


@pytest.mark.parametrize(
    "change, word",
    [
        ({"axial_load": None}, "axial_load = None: without load"),
        ({"axial_load": -1.0}, "axial_load = -1"),
        ({"interface": Top.rig(1e5, 1e6)}, "interface"),
        ({"effects": Effects(dimension="planar")}, "effects.dimension = 'planar'"),
        ({"effects": Effects(spin="patch")}, "effects.spin = 'patch': the interface transmits no torsion"),
        ({"solver": Solver(method="dopri5")}, "solver.method = 'dopri5'"),
        ({"bearing": BEARING.replace(rim_stiffness=0.0)}, "rim_stiffness = 0"),
    ],
)
def test_a_wrong_part_is_named(change: dict[str, object], word: str):
    parts = {"bearing": BEARING, "interface": INTERFACE, "axial_load": LOAD}
    with pytest.raises(InputError, match=word):
        TwoPort(**{**parts, **change})  # type: ignore[arg-type]


def test_a_node_needs_stiffness_and_is_no_top_of_a_scene():
    with pytest.raises(InputError, match=r"top\.vertical_stiffness = 0"):
        Top.node(1e6, 0.0, 1e6)
    with pytest.raises(InputError, match=r"top = Top\.node\(\.\.\.\): another program moves it"):
        Scene(BEARING, Motion.ramp(0.1, 1.0), INTERFACE)


def test_a_rig_preset_becomes_a_unit_with_the_values_that_its_message_gives():
    rig = load_scene("fenz-test2")
    with pytest.raises(InputError, match="this rig leaves its height free") as caught:
        scene_of_unit(rig)
    found = re.search(r"vertical_stiffness = (\S+), vertical_damping = (\S+)$", str(caught.value))
    assert found is not None and float(found[1]) == pytest.approx(600 * 112e3, rel=0.05)
    stiffness, damping = float(found[1]), float(found[2])
    top = replace(rig.top, vertical_stiffness=stiffness, vertical_damping=damping)
    unit = scene_of_unit(replace(rig, top=top, stop=Stop(displacement=0.1)))
    assert unit.top.vertical_stiffness == stiffness and unit.stop is None and unit.modelled.top_rotation


@pytest.mark.slow
def test_an_unloaded_bearing_takes_up_its_load():
    """With uplift it may start without load; lowering the upper end compresses it."""
    two_port = TwoPort(BEARING, INTERFACE, effects=Effects(uplift=True))
    lowered = np.zeros((3, 6))
    lowered[0, 2] = -LOAD / INTERFACE.vertical_stiffness
    assert abs(two_port.trial(0.0, STILL, STILL).wrench[1, 2]) < 1e-6 * LOAD
    found = two_port.trial(1.0, STILL, lowered).wrench[1, 2]  # the stiffness contains that of the contacts
    assert found == pytest.approx(-LOAD, rel=1e-4)


def test_both_implicit_methods_agree():
    found = [advance(port(1e-6, method=method), 0, 30, STEP) for method in ("implicit", "esdirk4")]
    assert np.abs(found[0] - found[1]).max() < 1e-3 * LOAD
