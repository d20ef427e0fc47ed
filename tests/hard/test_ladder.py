"""What Newton has to fall back on, rung by rung, and what a run says when no rung is left."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support import failure_of, scene_of
from support.stacks import LOAD, PLANAR, a_body, a_stack, nested_radii

from msfp_gen import Effects, Motion, RunError, Scene, Solver, Top, presets, simulate
from msfp_gen.results.history import Counters
from msfp_gen.results.result import Result

TFP = (5, 2, 2)
REPORT = Effects(bouc_wen="report")


def counters_of(scene: Scene) -> Counters:
    """Of the run, whether or not it ends well."""
    try:
        return simulate(scene).counters
    except RunError as error:
        assert isinstance(error.result, Result)
        return error.result.counters


def fallen() -> Scene:
    """A prototype whose top plate nothing holds level: it stands as long as friction holds, a tenth of a second."""
    bearing = presets.bearing("fenz-tfp").replace(contact_damping=0.0)
    return Scene(bearing, Motion.harmonic(0.01, 1.0), Top.rig(LOAD, 1e8), REPORT)


@pytest.mark.parametrize(
    "rung", ["halved_newton_steps", "fresh_tangents", "other_starts", "newton_failures", "quasistatic_starts"]
)
def test_every_rung_is_used_and_counted(rung: str) -> None:
    assert getattr(counters_of(fallen()), rung) > 0


def test_an_easy_run_stays_on_the_lowest_rungs() -> None:
    used = counters_of(scene_of("fenz-test2"))
    assert used.quasistatic_starts == used.newton_failures == 0
    assert used.fresh_tangents < used.newton_iterations / 2 and used.halved_newton_steps < used.steps


@pytest.mark.parametrize(
    "solver", [{}, {"rtol": 1e-7}, {"method": "dopri5"}, {"method": "dopri5", "rtol": 1e-7}], ids=str
)
def test_a_stack_that_falls_says_so_whatever_solves_it(solver: dict[str, float]) -> None:
    """All four used to differ: newton, newton, irregular, irregular. N goes to nothing at 103.2 ms."""
    error = failure_of(replace(fallen(), solver=Solver(**solver)))  # type: ignore[arg-type]
    assert error.status == "uplift"
    assert float(re.findall(r"t = (\S+) s", str(error))[0]) == pytest.approx(0.1032, abs=2e-4)
    assert "give it a rotational_stiffness" in str(error)


def jamming() -> Scene:
    """A mass on an orbit of 17 cm, thrown back by the rim of the lowest surface at 2.593 s."""
    bearing = a_stack(
        TFP,
        [1.0, 0.601, 0.601, 1.0],
        capacity=[0.17875, 0.10276, 0.10906, 0.14849],
        friction=[0.0279, 0.1442, 0.01427, 0.0279],
        yield_displacement=[1.66e-4, 9.34e-4, 1.1e-4, 4.49e-4],
        rim_stiffness=[6.531e7, 7.5685e7, 6.566e7, 1e6],
        rim_damping=[5.0, 1e3, 0.0, 1e3],
        contact_damping=0.0,
    )
    bodies = [
        a_body(mass, height) for mass, height in ((0.343, 0.01884), (0.05, 0.01625), (0.066, 0.02026), (1.0, 0.01428))
    ]
    orbit = Motion.circle(0.17288, 2 * np.pi * 0.36788, cycles=1.0, lead_in=0.5 / 0.36788)
    top = Top.mass(39250.6, 1962.5, 0.5, 3.84656e7, 3.84656e5)
    return Scene(replace(bearing, bodies=bodies), orbit, top, REPORT, Solver(rtol=1e-5))


@pytest.mark.parametrize(
    "solver",
    [{}, {"rtol": 1e-7}, pytest.param({"method": "dopri5", "rtol": 1e-6}, marks=pytest.mark.slow)],
    ids=str,
)
def test_a_normal_force_without_a_bound_is_loss_of_regularity_whatever_solves_it(solver: dict[str, float]) -> None:
    """Steep slopes, friction and the upward throw feed N, which grows a thousandfold within microseconds: the moment is
    the same for methods that share no integrator. They used to call it newton, newton and step."""
    scene = jamming()
    error = failure_of(replace(scene, solver=replace(scene.solver, max_steps=100_000, **solver)))  # type: ignore[arg-type]
    assert error.status == "irregular"
    assert float(re.findall(r"t = (\S+) s", str(error))[0]) == pytest.approx(2.5933, abs=5e-4)
    assert error.result.history.normal_force[-1].max() > 20 * 39250.6 * 9.8


def test_the_explicit_method_says_where_it_is_at_its_limit() -> None:
    """A damper that holds the tilt of a plate of a kilogram has decayed after a tenth of a microsecond. The steps that
    the error estimate allows are then those at which rounding neither grows nor decays: a stack that stays stuck was
    driven to 289 rad/s, and that was called a success."""
    bearing = a_stack(TFP, [1.0, 0.7, 0.5, 1.1], friction=[0.02, 0.05, 0.03, 0.08], yield_displacement=2e-4)
    top = Top.rig(4e6, 2.6e9, 0.0, 1.6e8, 1.6e6)
    solver, wave = Solver(method="dopri5", rtol=1e-5), Motion.harmonic(0.05, 0.5)
    scene = Scene(bearing, wave, top, Effects(), solver, duration=5e-4)
    assert failure_of(scene).status == "stiff"
    assert simulate(replace(scene, solver=Solver())).history.tilt_rates.max() < 1e-2
    loose = replace(scene, top=Top.rig(4e6, 2.6e9, 0.0, 1.6e8))
    assert simulate(replace(loose, duration=2e-4)).succeeded  # ringing without damping keeps it within its error


def test_the_remedy_it_names_helps() -> None:
    assert simulate(replace(fallen(), top=Top.rig(LOAD, 1e8, 0.0, 1e6))).succeeded


@pytest.mark.parametrize(
    ("scene", "status"),
    [
        (fallen(), "uplift"),
        (
            replace(scene_of("fenz-test5"), bearing=scene_of("fenz-test5").bearing.replace(friction=[20.0] * 4)),
            "irregular|newton",
        ),
        (scene_of("fenz-test1", {"rims": False, "dimension": "planar"}, motion=Motion.ramp(1.0, 1.5)), "angle"),
    ],
    ids=["fallen", "too rough", "pushed over"],
)
def test_the_last_word_has_time_surface_state_and_remedy(scene: Scene, status: str) -> None:
    said = str(failure_of(scene))
    assert re.fullmatch(status, failure_of(scene).status)
    assert re.match(r"stopped at t = \S+ s of \S+ s, surface [1-4], ", said), said
    assert re.search(r"\(last state: tilts up to \S+ rad, N \S+ to \S+ N, rims up to \S+ N\)", said), said
    assert re.search(r": .*(lower|increase|check|too high|give)", said), said


# ---- names that used to be wrong -------------------------------------------------------------------------------


def thrown(method: str = "implicit") -> Scene:
    """Ten tonnes on a triple pendulum, led beyond its reach: the rims are struck and the mass lifts."""
    bearing = a_stack(
        TFP,
        [1.0, 0.5, 0.5, 1.0],
        capacity=[0.1, 0.04, 0.04, 0.1],
        rim_stiffness=1e7,
        yield_displacement=1e-3,
        body={"mass": 2.0},
    )
    top = Top.mass(1e4, 500.0, 0.5, 1e7, 1e5)
    return Scene(bearing, Motion.harmonic(0.5, 0.45, cycles=1.0), top, PLANAR, Solver(method=method, rtol=1e-5))  # type: ignore[arg-type]


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_a_mass_thrown_against_rims_ends_as_uplift(method: str) -> None:
    error = failure_of(thrown(method))
    assert error.status == "uplift" and isinstance(error.result, Result)
    assert error.result.summary["rims_met"]


def test_a_load_through_zero_is_uplift_for_the_explicit_method_too() -> None:
    t = np.linspace(0.0, 1.0, 101)
    drop = Motion.from_acceleration(t, np.outer(np.sin(np.pi * t / 2), [0.3, 0.0, -12.0]))
    top = Top.mass(1e4, 300.0, 0.5, 1e7, 1e4)
    ends = []
    for method in ("implicit", "dopri5"):
        solver = Solver(method=method, rtol=1e-4)  # type: ignore[arg-type]
        bearing = a_stack((3, 1, 1), [1.0, 1.0], yield_displacement=5e-3, body={"mass": 5.0})
        error = failure_of(Scene(bearing, drop, top, PLANAR, solver))
        assert error.status == "uplift" and isinstance(error.result, Result)
        ends.append(error.result.history.time[-1])
    assert ends[0] == pytest.approx(ends[1], abs=2e-3)


@pytest.mark.slow
def test_a_first_step_that_is_too_long_does_not_decide_what_is_regular() -> None:
    """Nine bodies whose plate is held by friction alone stand still for a while. The sign of the determinant
    used to be that of a first step longer than the time in which they would fall: every shorter step was refused."""
    layout = (9, 4, 4)
    friction = [0.04, 0.01, 0.15, 0.15, 0.0, 0.01, 0.01, 0.03]
    bearing = a_stack(layout, nested_radii(layout, 3.0, 0.7), friction=friction, yield_displacement=1e-4)
    scene = Scene(bearing, Motion.harmonic(0.05, 0.5), Top.prescribed((0.0, 0.0, -7e5)), PLANAR, duration=0.5)
    assert failure_of(scene).status in ("uplift", "angle", "newton")


@pytest.mark.parametrize("method", ["implicit", "dopri5"])
def test_a_violent_start_is_regular(method: str) -> None:
    """Let go far from where it would rest; a first step of 0.1 ms would be past the fall of the free plate."""
    from msfp_gen.scene.scene_fields import InitialState

    bearing = a_stack((3, 1, 1), [0.8, 0.8], friction=[0.03, 0.09], body={"mass": 1.0}, yield_displacement=1e-3)
    start = InitialState([(0.0, -0.02, 0.0), (0.0, -0.05, 0.0)], np.zeros((2, 3)), [(-0.1, 0.0), (-0.4, 0.0)])
    still = Motion(knots=[0.0, 1.0], coefficients=np.zeros((1, 6, 6)))
    scene = Scene(
        bearing,
        still,
        Top.prescribed((0.0, 0.0, -5e5)),
        PLANAR,
        Solver(method=method, rtol=1e-6),  # type: ignore[arg-type]
        duration=1e-3,
        initial_state=start,
    )
    run = simulate(scene)
    assert run.succeeded and np.abs(run.history.tilt_rates[-1]).max() > 1.0


def test_a_heavy_mass_on_massless_sliders_is_not_called_irregular() -> None:
    """Its inertia up and down acts through slopes alone, and friction may give it either sign; sliders of a kilogram,
    which have an inertia of their own, go the same way."""
    layout = (5, 2, 2)
    bearing = a_stack(layout, nested_radii(layout, 1.2, 0.6), friction=[0.0, 0.02, 0.05, 0.01], body={"mass": 1.0})
    t = np.linspace(0, 3.0, 301)
    shake = Motion.from_arrays(t, np.outer(0.1 * np.sin(np.pi * t / 3) ** 3 * np.sin(6 * t), [1.0, 0.0, 0.0]))
    top = Top.mass(2e3, 300.0, 0.1, 7e5, 7e3)
    scene = Scene(bearing, shake, top, PLANAR, Solver(rtol=1e-6), output_step=0.02)
    heavy, light = (
        simulate(replace(scene, effects=Effects(dimension="planar", sliders=s)))  # type: ignore[arg-type]
        for s in ("inertial", "massless")
    )
    force = heavy.history.top_force[:, 0]
    assert np.abs(light.history.top_force[:, 0] - force).max() < 0.05 * np.abs(force).max()


@pytest.mark.parametrize("rtol", [1e-4, 3e-5])
def test_loose_sliders_hop_until_one_has_left_its_place(rtol: float) -> None:
    """Nearly without friction nothing brings the sliders back between hops. That used to end as newton at 0.89 s, where
    residuals of rounding were asked to be smaller, and later with steps of nanoseconds towards the moment at which
    a slider is beside its cup: when that is depends on chaos, what it is does not."""
    from support.flights import UPLIFT, shaken

    scene = shaken(1.4, sideways=0.02, duration=2.0, rtol=rtol, effects=replace(UPLIFT, bouc_wen="report"))
    error = failure_of(
        replace(scene, bearing=scene.bearing.replace(friction=1e-3, contact_damping=0.0, seat_damping=1.0))
    )
    assert error.status == "separated" and isinstance(error.result, Result)
    assert 1.0 < error.result.history.time[-1] < 2.0
    assert error.result.history.normal_force[-1].max() < 1.0  # in flight


def test_a_balance_may_lie_within_the_jump_of_a_rims_damper() -> None:
    """A rim with a damper is met with a jump of force, and where the balance lies within it no residual is zero: Newton
    went to and fro over 2e-8 of friction for ever, at 186 s of this run."""
    scene = scene_of("fenz-test4", {"dimension": "planar", "sliders": "massless"}, {"method": "esdirk4", "rtol": 1e-7})
    assert simulate(scene).succeeded
