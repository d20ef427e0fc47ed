"""The unit of a rig: motion in, wrench out."""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import ROOT
from support.ends import LOAD, port, swing
from support.standard import objections
from support.units import Unit, rig

from msfp_gen import Solver, TwoPort
from msfp_gen.embedding.unit import write_fmu

pytest.importorskip("fmpy")

STEP = 0.02
TIMES = np.cumsum(np.concatenate([[0.0], np.full(40, STEP)]))  # communication points


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_fmu(rig(), tmp_path_factory.mktemp("rig") / "bearing.fmu", version=3).path


def test_it_conforms_to_the_standard(unit: Path) -> None:
    assert objections(unit, 3) == []


def advance(unit: Unit, begin: int, end: int) -> list[np.ndarray]:
    return [unit.step(TIMES[i], STEP, swing(TIMES[i + 1])) for i in range(begin, end)]


def test_wrenches_and_derivatives_are_those_of_the_two_port_bit_by_bit(unit: Path) -> None:
    two_port = port()
    with Unit(unit, inputs_at_step_end=True) as at_work:
        at_work.start()
        for i, found in enumerate(advance(at_work, 0, 30)):
            response = two_port.trial(TIMES[i + 1], *swing(TIMES[i + 1]))
            assert np.array_equal(found, [*response.wrench.ravel(), *response.sliding, *response.normal_force])
            expected = (response.tangent, response.damping, response.inertia) if i == 29 else None
            two_port.commit()
        assert expected is not None
        for order, matrix in enumerate(expected):
            knowns = [1 + 18 * end + 6 * order + freedom for end in (0, 1) for freedom in range(6)]
            columns = [at_work.derivative(at_work.outputs[:12], known) for known in knowns]
            assert np.array_equal(np.transpose(columns), matrix)
        following = advance(at_work, 30, 33)  # derivatives leave the state as it was
        for i, found in enumerate(following):
            response = two_port.trial(TIMES[31 + i], *swing(TIMES[31 + i]))
            assert np.array_equal(found[:12], response.wrench.ravel())
            two_port.commit()
    assert np.abs(found).max() > 0.5 * LOAD


def test_the_example_of_the_page_runs(unit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(unit.parent)
    page = (ROOT / "docs" / "other-programs.md").read_text(encoding="utf-8").split("\n## Bearings as FMUs\n")[1]
    names: dict[str, np.ndarray] = {}
    exec(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)[0], names)
    assert len(names["result"]) == 100 and np.abs(names["result"]["upper.force[1]"]).max() > 0.02 * LOAD


def test_inputs_at_the_begin_of_steps_are_extrapolated(unit: Path) -> None:
    """The error falls with the square of the step at least."""
    exact, errors = port(1e-6), []
    for i in range(1, 41):
        wrench = exact.trial(0.01 * i, *swing(0.01 * i)).wrench.ravel()
        exact.commit()
    for step, count in ((0.01, 40), (0.0025, 160)):
        with Unit(unit, solver__rtol=1e-6) as at_work:
            at_work.start()
            for i in range(count):
                found = at_work.step(step * i, step, swing(step * i))
        errors.append(np.abs(found[:12] - wrench).max())
    assert errors[0] < 0.05 * LOAD
    assert errors[1] < errors[0] / 8


CONTINUE = """
import sys
from pathlib import Path
import numpy as np
from support.ends import swing
from support.units import Unit
path, step = Path(sys.argv[1]), float(sys.argv[2])
with Unit(path) as unit:
    unit.start()
    unit.restore(Path(sys.argv[3]).read_bytes())
    times = np.cumsum(np.concatenate([[0.0], np.full(40, step)]))
    rows = [unit.step(times[i], step, swing(times[i + 1])) for i in range(20, 30)]
    rows += [unit.derivative(unit.outputs, 19)]
np.save(sys.argv[4], np.array(rows))
"""


def test_a_serialised_state_goes_on_in_a_new_process_bit_by_bit(unit: Path, tmp_path: Path) -> None:
    """With parameters other than the start values, which the state holds too."""
    with Unit(unit, inputs_at_step_end=True, **{"surface[1]__friction": 0.03}) as at_work:
        at_work.start()
        advance(at_work, 0, 20)
        (tmp_path / "state").write_bytes(at_work.state())
        expected = [*advance(at_work, 20, 30), at_work.derivative(at_work.outputs, 19)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    files = [str(unit), str(STEP), str(tmp_path / "state"), str(tmp_path / "rows.npy")]
    subprocess.run([sys.executable, "-c", CONTINUE, *files], check=True, env=environment)
    assert np.array_equal(np.load(tmp_path / "rows.npy"), expected)


def test_states_go_back_and_damaged_ones_are_refused(unit: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with Unit(unit, inputs_at_step_end=True) as at_work:
        at_work.start()
        advance(at_work, 0, 5)
        state = at_work.state()
        first = advance(at_work, 5, 8)
        at_work.restore(state)
        assert np.array_equal(advance(at_work, 5, 8), first)
        for damaged in (state[:-1], state[:300] + bytes([state[300] ^ 1]) + state[301:], b"none"):
            with pytest.raises(FMICallException):
                at_work.restore(damaged)
            assert "no state of this unit, or are damaged" in at_work.messages[-1]
        at_work.restore(state)
        assert np.array_equal(advance(at_work, 5, 8), first)


def test_a_state_from_before_the_start_has_no_step(unit: Path) -> None:
    """At the start the outputs do not depend on the inputs."""
    with Unit(unit, inputs_at_step_end=True) as at_work:
        at_work.fmu.enterInitializationMode(startTime=0.0)
        state = at_work.state()
        at_work.fmu.exitInitializationMode()
        first = advance(at_work, 0, 3)
        assert at_work.derivative(at_work.outputs, 19).any()
        at_work.restore(state)
        assert not at_work.derivative(at_work.outputs, 19).any()
        at_work.fmu.exitInitializationMode()
        assert np.array_equal(advance(at_work, 0, 3), first)


def test_parameters_are_those_of_a_two_port(unit: Path) -> None:
    with Unit(unit, inputs_at_step_end=True, axial_load=90e3, solver__rtol=1e-5) as at_work:
        at_work.start()
        found = advance(at_work, 0, 10)[-1]
        at_work.fmu.reset()
        at_work.set("inputs_at_step_end", True)
        at_work.start()
        as_given = advance(at_work, 0, 10)[-1]
    reference = port()
    other = TwoPort(reference.bearing, reference.interface, 90e3, solver=Solver(rtol=1e-5))
    for two_port, expected in ((other, found), (reference, as_given)):
        for i in range(10):
            wrench = two_port.trial(TIMES[i + 1], *swing(TIMES[i + 1])).wrench.ravel()
            two_port.commit()
        assert np.array_equal(expected[:12], wrench)


def test_failures_are_errors_with_a_message_and_leave_the_unit_where_it_was(unit: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with Unit(unit, inputs_at_step_end=True) as at_work:
        at_work.start()
        advance(at_work, 0, 3)
        torn = swing(4 * STEP)
        torn[1, :, 2] += 0.1  # the upper end lifts off
        with pytest.raises(FMICallException):
            at_work.step(TIMES[3], STEP, torn)
        assert "step: uplift at t = 0.0" in at_work.messages[-1]
        for time, step, words in (
            (1.0, STEP, "the unit is at 0.06 s"),
            (TIMES[3], 0.0, "give a finite number above 0"),
        ):
            with pytest.raises(FMICallException):
                at_work.step(time, step)
            assert words in at_work.messages[-1]
        found = advance(at_work, 3, 5)[-1]
    with Unit(unit, inputs_at_step_end=True) as other:
        assert np.array_equal(advance(other.start(), 0, 5)[-1], found)


def test_what_it_refuses_is_named(unit: Path) -> None:
    from fmpy.fmi1 import FMICallException

    with Unit(unit) as at_work:
        for name, value, words in (
            ("lower.velocity[1]", np.nan, "lower.velocity[1]: give a finite number"),
            ("upper.force[1]", 1.0, "upper.force[1]: it cannot be set now"),
        ):
            with pytest.raises(FMICallException):
                at_work.set(name, value)
            assert words in at_work.messages[-1]
        with pytest.raises(FMICallException):
            at_work.fmu.doStep(0.0, STEP)
        assert "not allowed before the initialization mode" in at_work.messages[-1]
        at_work.set("surface[2].radius", -1.0)
        with pytest.raises(FMICallException):
            at_work.start()
        assert "parameters: surfaces: radius: give a finite number above 0 [m]" in at_work.messages[-1]
        at_work.set("surface[2].radius", 1.0)
        at_work.fmu.exitInitializationMode()
        with pytest.raises(FMICallException):
            at_work.set("surface[2].radius", 1.0)
        with pytest.raises(FMICallException):
            at_work.derivative(at_work.outputs, 1)
        assert "make a step first" in at_work.messages[-1]
        with pytest.raises(FMICallException):
            at_work.fmu.enterEventMode()


def test_functions_of_model_exchange_are_refused_in_co_simulation(unit: Path) -> None:
    with Unit(unit, inputs_at_step_end=True) as at_work:
        at_work.start()
        for function, given in (("EnterEventMode", ()), ("SetTime", (ctypes.c_double(0.5),))):
            assert at_work.call(function, *given) == 3  # an error
            assert f"{function}: this instance is for Co-Simulation" in at_work.messages[-1]
        assert at_work.get("time") == 0.0
        assert at_work.step(0.0, STEP).any()
