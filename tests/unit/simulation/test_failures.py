"""Every named end of a run, reached on purpose: a clear line, and a result with everything computed until then."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from support import failure_of, hearing, scene_of

from msfp_gen import Effects, Motion, RunError, Scene, Solver, Top, build_model, presets, simulate
from msfp_gen.results.result import Result, load_result
from msfp_gen.scene.scene_fields import InitialState

LOAD = 112e3
STILL = Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))


def partial(error: RunError, status: str) -> Result:
    """The result of a failed run, once message and rows are as promised."""
    result = error.result
    assert isinstance(result, Result)
    assert error.status == result.status == status and not result.succeeded
    assert str(error) == result.message and "\n" not in result.message
    assert re.match(r"stopped at t = [0-9.e+-]+ s of [0-9.e+-]+ s", result.message), result.message
    rows = [np.ravel(values) for values in vars(result.history).values() if isinstance(values, np.ndarray)]
    assert np.isfinite(np.concatenate(rows)).all()
    assert result.summary["status"] == status
    assert result.dataset.attrs["message"] == result.message
    return result


def drop(size: float) -> Motion:
    """A base that falls away with a sine of `size` [m/s^2] and returns."""
    t = np.linspace(0.0, 2.0, 201)
    return Motion.from_acceleration(t, np.outer(np.sin(np.pi * t), [0.0, 0.0, -size]))


def test_uplift_under_a_falling_base_names_surface_and_force() -> None:
    scene = Scene(presets.bearing("fenz-tfp"), drop(12.0), Top.mass(11e3, 300.0, 0.5, 1e7, 1e4), Effects())
    result = partial(failure_of(scene), "uplift")
    assert re.search(r", surface [1-4], P\.t3 \[N\] = \S+: .*uplift", result.message), result.message
    assert len(result.history.time) > 2 and result.history.normal_force.min() > 0


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 1e-4])
def test_massless_sliders_without_a_unique_motion_name_the_remedy(damping: float) -> None:
    """With the law of pressure, velocity and temperature: contact damping is one remedy, inertia the one for all."""
    bearing = presets.bearing("fenz-tfp").replace(reference_pressure=15e6, contact_damping=damping)
    top = Top.rig(LOAD, 1e8, 5.0, 1e6, 5.0)
    effects = Effects(dimension="planar", friction="pvt", bouc_wen="plastic", sliders="massless")
    scene = Scene(bearing, Motion.harmonic(0.05, 0.5, cycles=1), top, effects, duration=0.5)
    if damping:
        assert simulate(scene).succeeded
        return
    error = failure_of(scene)
    result = partial(error, error.status)
    assert "sliders are massless" in result.message and "give effects.sliders = 'inertial'" in result.message
    assert simulate(replace(scene, effects=replace(effects, sliders="inertial"))).succeeded


@pytest.mark.parametrize(
    ("top", "named"),
    [
        (Top.rig(0.0, 1e8), r"surface 4, P\.t3 \[N\] = "),
        (Top.prescribed((0.0, 0.0, 5e3)), r"surface 1, P\.t3 \[N\] = -"),
    ],
    ids=["lifted off", "pulled up"],
)
def test_uplift_at_the_start_keeps_no_false_rows(top: Top, named: str) -> None:
    """Without axial load a falling base lifts off; pulled up it does so at once, and there is nothing to keep."""
    error = failure_of(Scene(presets.bearing("fenz-tfp"), drop(12.0), top, Effects()))
    assert error.status == "uplift" and re.search(named, str(error)), str(error)
    if isinstance(error.result, Result):
        assert error.result.history.normal_force.min() > 0


@pytest.mark.parametrize("friction", [8.0, 20.0])
def test_friction_too_high_for_a_unique_motion(friction: float) -> None:
    """Far beyond the report's friction no acceleration is left: the determinant changes its sign, or Newton fails."""
    scene = scene_of("fenz-test5")
    error = failure_of(replace(scene, bearing=scene.bearing.replace(friction=[friction] * 4)))
    assert error.status in ("irregular", "newton")
    result = partial(error, error.status)
    assert re.search(r", surface [1-4], residual = \S+: .*(determinant|Newton)", result.message), result.message
    assert result.history.time[-1] > 1.0


def test_angle_beyond_the_euler_angles() -> None:
    """Without rims nothing stops a bearing pushed over: it ends at the singularity, with the angle named."""
    scene = scene_of("fenz-test1", {"rims": False, "dimension": "planar"})
    result = partial(failure_of(replace(scene, motion=Motion.ramp(1.0, 1.5))), "angle")
    assert re.search(r"surface [1-4], angle \[rad\] = -?1\.5\S*: a tilt nears 90", result.message), result.message


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_steps_used_up(method: str) -> None:
    result = partial(failure_of(scene_of("fenz-test2", solver={"method": method, "max_steps": 20})), "steps")
    assert "max_steps" in result.message
    counters = result.counters
    assert counters.steps + counters.rejected_steps == 20 and len(result.history.time) == counters.steps + 1


def test_partial_result_is_written_and_read(tmp_path) -> None:  # type: ignore[no-untyped-def]
    result = partial(failure_of(scene_of("fenz-test2", solver={"max_steps": 20})), "steps")
    again = load_result(result.to_netcdf(tmp_path / "partial.nc"))
    assert (again.status, again.message) == (result.status, result.message)
    assert np.array_equal(again.history.top_force, result.history.top_force)


INTERRUPTED = """
import json, sys
from dataclasses import replace
from msfp_gen import RunError, load_scene, simulate
scene = load_scene("fenz-test2")
scene = replace(scene, solver=replace(scene.solver, method="dopri5", rtol=1e-8), output_step=0.01)
def ready(t, end):
    print("running", flush=True)
try:
    simulate(scene, progress=ready)
except RunError as error:
    history = error.result.history
    print(json.dumps([error.status, str(error), len(history.time), float(history.time[-1])]))
"""


def test_interrupt_keeps_what_was_computed() -> None:
    """Ctrl-C in the middle of the compiled loop."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", INTERRUPTED], text=True, preexec_fn=hearing, **pipes)
    assert process.stdout is not None and process.stdout.readline() == "running\n"
    begin = time.perf_counter()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert time.perf_counter() - begin < 5
    assert process.returncode == 0, err
    status, message, rows, reached = json.loads(out.splitlines()[-1])
    assert status == "interrupted" and "interrupted" in message
    assert rows > 1 and reached > 0


def test_initial_state_under_tension_is_refused_at_once() -> None:
    q = np.zeros((4, 3))
    start = InitialState(q, q, q[:, :2])
    scene = Scene(presets.bearing("fenz-tfp"), STILL, Top.prescribed((0.0, 0.0, 1e5)), Effects(), initial_state=start)
    assert failure_of(scene).status == "uplift"


def test_a_start_from_which_newton_diverges_is_named() -> None:
    """All that is given is finite, no acceleration is: a rig of 1 GN/m throws a top that starts displaced."""
    tilts = [[0.07, -0.03], [0.04, 0.07], [0.03, 0.01], [0.05, 0.04]]
    q = np.array([[*tilt, 0.0] for tilt in tilts])
    start = InitialState(q, 0 * q, [(0.1, 0.3), (-0.5, 0.2), (0.3, -0.1), (0.0, -0.3)])
    scene = Scene(presets.bearing("fenz-tfp"), STILL, Top.rig(LOAD, 1e9, 0.0, 1e6), Effects(), initial_state=start)
    error = failure_of(scene)
    assert error.status == "newton" and "stopped at t = 0 s" in str(error)
    assert "the springs of the rig are anchored above the base" in str(error)
    held = Scene(presets.bearing("fenz-tfp"), drop(12.0), Top.rig(0.0, 1e8), Effects())
    assert "springs" not in str(failure_of(held))


@pytest.mark.parametrize("tilt", [0.1, 0.19])
def test_a_displaced_start_without_inertia_names_a_remedy_that_works(tilt: float) -> None:
    """A frictional dish of 2.2 m under a free load: massless sliders have no unique motion there."""
    bearing, effects = presets.bearing("single-fp"), Effects(dimension="planar", sliders="massless")
    start = InitialState([[0.0, tilt, 0.0]], [[0.0] * 3], [[0.0, 0.0]])
    scene = Scene(bearing, STILL, Top.rig(1e6, stiffness=0.0), effects, Solver(method="esdirk4"), initial_state=start)
    error = failure_of(scene)
    assert error.status in ("newton", "irregular") and "springs" not in str(error)
    assert " ... " not in str(error) and str(error).endswith("give effects.sliders = 'inertial'")
    assert simulate(replace(scene, effects=replace(effects, sliders="inertial"))).succeeded


def test_massless_evaluation_gives_rates_and_names_uplift() -> None:
    """A massless stack has no acceleration; its contact is defined all the same, and it cannot pull either."""
    bearing, shape = presets.bearing("fenz-tfp"), (4, 3)
    state = (np.full(shape, [0.0, 0.02, 0.0]), np.full(shape, [0.0, 0.2, 0.0]), np.full((4, 2), [0.3, 0.0]))
    massless = build_model(bearing.layout, Effects(dimension="planar", sliders="massless"))
    found = massless.evaluate(bearing, *state, top_force=(0.0, 0.0, -112e3))
    heavy = build_model(bearing.layout, Effects(dimension="planar")).evaluate(
        bearing, *state, top_force=(0.0, 0.0, -112e3)
    )
    assert found.acceleration is None
    assert np.abs(found.friction_rate - heavy.friction_rate).max() < 1e-2 * np.abs(heavy.friction_rate).max()
    with pytest.raises(RunError, match="would have to pull"):
        massless.evaluate(bearing, *state, top_force=(0.0, 0.0, 112e3))
