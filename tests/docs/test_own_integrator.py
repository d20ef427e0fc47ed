"""docs/own_integrator.md runs: its methods have their orders, and give what `simulate` gives."""

from __future__ import annotations

import contextlib
import re
import sys
import time
from typing import Any

import numpy as np
import pytest
from support import ROOT, model_of

from msfp_gen import InputError, Scene, Solver, presets, simulate
from msfp_gen.cli import main

PAGE = ROOT / "docs" / "own_integrator.md"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The names that the page defines, after it ran in an empty folder."""
    space: dict[str, Any] = {}
    with contextlib.chdir(tmp_path_factory.mktemp("page")), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [*sys.path])
        patch.delitem(sys.modules, "equations_3_1_1", raising=False)  # of another test: in space
        run(space)
    return space


def run(space: dict[str, Any]) -> None:
    """Run the command and the blocks of the page."""
    text = PAGE.read_text(encoding="utf-8").split("\n## The equations in SymPy\n")[0]
    command = re.search(r"^msfp-gen (generate .*)$", text, re.MULTILINE)
    assert command is not None and main(command[1].split()) == 0
    for block in re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        exec(block, space)


@pytest.mark.slow
def test_methods_tend_to_what_simulate_gives(page):
    scene = Scene(
        bearing=page["bearing"],
        motion=page["motion"],
        top=page["top"],
        duration=0.5,
        output_step=2e-3,
        effects=page["model"].effects,
        solver=Solver(rtol=1e-7),
    )
    want = simulate(scene).history.tilt_angles[:, :, 1]
    size = np.abs(want).max()
    fine = page["fine"][:, :, 1]
    assert fine.shape == want.shape and np.abs(fine - want).max() < 1e-3 * size
    for name in ("midpoint", "bdf2"):
        for stage in ("stage", "stage_of_stack"):
            errors = [np.abs(page[name](0.5, 1e-2 / n, page[stage])[::n, :, 1] - want[::5]).max() for n in (1, 4)]
            assert errors[1] < 2e-3 * size, name
            assert errors[0] / errors[1] > 8, name  # 16 by order 2
    found = page["solve_ivp"](
        page["fun"], (0, 0.5), page["y0"], method="Radau", jac=page["jac"], rtol=1e-6, atol=1e-8
    ).y[:6, -1]
    assert np.abs(found.reshape(2, 3)[:, 1] - want[-1]).max() < 1e-4 * size


def test_friction_as_an_unknown_gives_what_the_runtime_solves(page):
    alone, solved = (page["midpoint"](0.1, 2e-3, page[name]) for name in ("stage", "stage_of_stack"))
    assert np.abs(alone - solved).max() < 1e-8 * np.abs(solved).max() and np.abs(solved).max() > 1e-5


def test_many_states_are_the_states_one_by_one(page):
    model, bearing, top = page["model"], page["bearing"], page["top"]
    rng = np.random.default_rng(1)
    plane = np.array([0.0, 1.0, 0.0])
    q, v = (rng.uniform(-0.02, 0.02, (7, 2, 3)) * plane for _ in range(2))
    h = rng.uniform(-0.9, 0.9, (7, 2, 2)) * [1.0, 0.0]
    base, load = np.zeros((7, 3, 6)), np.zeros((7, 6))
    base[:, 2, 0], load[:, 2] = rng.uniform(-2, 2, 7), rng.uniform(-4e5, -2e5, 7)
    many = model.accelerations(bearing, q, v, h, base=base, load=load, top=top)
    stack = model.stack(bearing, top)
    for i in range(7):
        status, a, row, rates, *_ = stack.accelerations(q[i], v[i], h[i], base[i], load[i])
        assert status == "ok"
        assert np.array_equal(many["acceleration"][i], a) and np.array_equal(many["friction_rate"][i], rates)
        for name, value in model.unpack(row).items():
            assert np.array_equal(many[name][i], value, equal_nan=True)
    shared = model.accelerations(bearing, q, v, h, base=base[0], load=load[0], top=top)
    assert np.array_equal(shared["acceleration"][0], many["acceleration"][0])


def test_wrong_states_are_named(page):
    model, bearing = page["model"], page["bearing"]
    q, h = np.zeros((3, 2, 3)), np.zeros((3, 2, 2))
    with pytest.raises(InputError, match="v has shape"):
        model.accelerations(bearing, q, q[:2], h)
    with pytest.raises(InputError, match="q leaves the E1-E3 plane"):
        model.accelerations(bearing, q + np.array([0.1, 0.0, 0.0]), q, h)
    seated, closed = model_of((5, 2, 2), uplift=True, dimension="planar"), np.zeros((3, 4, 6))
    aside = closed + np.array([0.0, 0.0, 0.0, 0.0, 1e-4, 0.0])  # along E2
    for name, state in {"q": (aside, closed), "v": (closed, aside)}.items():
        with pytest.raises(InputError, match=f"{name} leaves the E1-E3 plane"):
            seated.accelerations(presets.bearing("fenz-tfp"), *state, np.zeros((3, 4, 2)))
    with pytest.raises(InputError, match="finite"):
        model.accelerations(bearing, q * np.nan, q, h)
    lifted = np.zeros((3, 6))
    lifted[1, 2] = np.nan
    with pytest.raises(InputError, match="load"):
        model.accelerations(bearing, q, q, h, load=lifted)


def test_ten_thousand_states_of_a_triple_pendulum_cost_what_the_c_code_costs():
    """Checks, shapes and names of results take less than twice the time of the loop in C beside it."""
    model, bearing = model_of((5, 2, 2)), presets.bearing("fenz-tfp")
    count = 10_000
    tilts = np.random.default_rng(0).uniform(-0.02, 0.02, (count, 4, 3)) * [1.0, 1.0, 0.0]
    h, base, load = np.zeros((count, 4, 2)), np.zeros((count, 3, 6)), np.zeros((count, 6))
    load[:, 2] = -112e3
    stack = model.stack(bearing)

    def cpu(call):
        times = []
        for _ in range(3):
            begin = time.process_time()
            call()
            times.append(time.process_time() - begin)
        return min(times)

    alone = cpu(lambda: stack.many_accelerations(tilts, 0 * tilts, h, base, load))
    assert cpu(lambda: model.accelerations(bearing, tilts, 0 * tilts, h, load=load[0])) < 3 * alone
