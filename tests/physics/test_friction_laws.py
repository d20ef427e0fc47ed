"""Laws of the friction coefficient in the compiled model, against the publications' formulas in plain numpy."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reference import friction_laws as reference
from support import Array, bearing_of, differences, failure_of, model_of, scene_of, thinned
from support.emitted_c import warnings_of
from support.friction_scenes import FORMULA, LAWS, P_REF, RADIUS, VALUES, heated, lawful
from support.random_states import inputs, sensible

from msfp_gen import Effects, InputError, Layout, Motion, RunError, Scene, Solver, build_model, simulate
from msfp_gen.generator import generate
from msfp_gen.jit.build import runtime_sources
from msfp_gen.results.result import Result, load_result
from msfp_gen.scene.file.loader import scene_from_table, scene_text
from msfp_gen.scene.friction_parameters import coefficient
from msfp_gen.specification.friction_laws import (
    BUILT_IN,
    HEAT_ERROR,
    HEAT_KERNEL,
    HEAT_ONSET,
    LONGEST,
    SHORTEST,
    law_of,
)
from msfp_gen.specification.layout import ModelSpec


def slowed(scene: Scene, share: float = 0.5, rate: float = 100.0) -> Scene:
    """The law of velocity: friction at rest is a share of the given one."""
    slow = [share * surface.friction for surface in scene.bearing.surfaces]
    return lawful(scene, "velocity", friction_slow=slow, velocity_rate=rate)


# ---- the formulas ---------------------------------------------------------------------------------------------------


def test_factors_of_kumar_are_the_published_ones() -> None:
    law, given = BUILT_IN["pvt"], {"reference_pressure": 50e6, "velocity_rate": 100.0, "mu": 1.0}

    def mu(**at: Any) -> Any:
        neutral = {"v": 10.0, "p": 50e6, "T": 20.0}
        return coefficient(law, {**{k: v for k, v in law.parameters.items() if v}, **given, **neutral, **at})[0]

    assert mu(T=20.0) == pytest.approx(1.0, abs=1e-15)
    assert mu(T=200.0) == pytest.approx(0.505, abs=5e-4)
    assert mu(p=100e6) == pytest.approx(0.7, rel=1e-14) and mu(v=0.0) == pytest.approx(0.5, rel=1e-14)
    T, p, v = np.linspace(-20, 400, 40), np.linspace(0, 2e8, 40), np.linspace(0, 0.2, 40)
    assert np.allclose(mu(T=T), reference.kt(T), rtol=4e-4)  # 0.789 is rounded
    assert np.allclose(mu(p=p), reference.kp(p, 50e6), rtol=1e-12)
    assert np.allclose(mu(v=v), reference.kv(v), rtol=1e-12)


def in_plane(state: Any, load: Any) -> tuple[Any, Any]:
    """What of a state and of a load lies in the plane E1-E3."""
    turn, move = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 1.0])
    base = state.base
    names = {"displacement": move, "velocity": move, "acceleration": move} | dict.fromkeys(
        ("angles", "rates", "rate_rates"), turn
    )
    base = replace(base, **{name: getattr(base, name) * keep for name, keep in names.items()})
    state = replace(state, base=base, **{name: getattr(state, name) * turn for name in ("q", "v", "a")})
    return state, replace(load, force=load.force * move, moment=load.moment * turn)


@cache
def case(word: str, **effects: Any) -> tuple[Any, ...]:
    """A random state of a triple pendulum, temperature included, and its model. All surfaces slide but the last, which
    unloads.
    """
    values, state, h, load = sensible((5, 2, 2), 5)
    flat = effects.get("dimension") == "planar"
    if flat:
        state, load = in_plane(state, load)
    bearing = bearing_of(values)
    slip = model_of((5, 2, 2)).evaluate(bearing, state.q, state.v, h, **inputs(state, load)).slip_velocity
    h = slip / np.hypot(*slip.T)[:, None] * np.array([[0.9], [0.8], [0.7], [-0.8]]) + [0.05, -0.05]
    h = h * [1.0, 0.0] if flat else h
    bearing = bearing.replace(**VALUES[word])
    heat = {"temperature": np.array([30.0, 150.0, 80.0, 20.0])} if word == "pvt" else {}
    return model_of((5, 2, 2), friction=word, **LAWS[word], **effects), bearing, state, h, load, heat


@pytest.mark.parametrize(
    ("word", "dimension"),
    thinned(product(LAWS, ["planar", "spatial"]), lambda word, dimension: dimension == "planar" and word != "velocity"),
)
def test_coefficient_equals_the_reference(word: str, dimension: str) -> None:
    model, bearing, state, h, load, heat = case(word, dimension=dimension)
    found = model.evaluate(bearing, state.q, state.v, h, **inputs(state, load), **heat)
    mu, N = np.array([s.friction for s in bearing.surfaces]), found.normal_force
    v = reference.sliding_velocity(h, found.slip_velocity)
    radius = np.array([bearing.slider_rim_radius(i) for i in range(4)])
    assert (v[:3] > 1e-3).all() and v[3] == 0
    want = {
        "velocity": lambda: reference.velocity(mu, 0.01, 20.0, v),
        "pvt": lambda: (
            mu
            * reference.kp(N / (np.pi * radius**2), 2e6)
            * reference.kv(v, 20.0)
            * reference.kt(heat["temperature"])
            / reference.kt(20.0)
        ),
        "custom": lambda: mu * (1 - 0.5 * np.exp(-20 * v)) * np.maximum(1 - np.tanh(N / 2e4) / 5, 0.5),
    }[word]()
    assert found.friction_coefficient == pytest.approx(want, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "spin"), thinned(product(LAWS, ["locked", "patch"]), lambda word, spin: spin == "locked")
)
def test_condensed_form_equals_the_reports(word: str, spin: str) -> None:
    """mu as a local unknown beside Y and Z, or in one line from the unknowns of the report."""
    model, bearing, state, h, load, heat = case(word, spin=spin)
    ways = [
        model.evaluate(bearing, state.q, state.v, h, **inputs(state, load), **heat, formulation=way)
        for way in ("condensed", "report")
    ]
    a, b = (way.acceleration for way in ways)
    assert np.abs(a - b).max() < 1e-9 * np.abs(a).max()
    for name in ("normal_force", "friction_coefficient", "contact_angles"):
        assert getattr(ways[0], name) == pytest.approx(getattr(ways[1], name), rel=1e-9, abs=1e-12)


EFFECTS: tuple[dict[str, str], ...] = ({}, {"dimension": "planar"}, {"bouc_wen": "isotropic"}, {"sliders": "massless"})
OFTEN = {"pvt": "dimension"}  # a law with an effect that changes its equations


@pytest.mark.parametrize(
    ("word", "effects"),
    thinned(product(LAWS, EFFECTS), lambda word, effects: OFTEN.get(word) in effects),
    ids=str,
)
def test_tangent_of_a_stage_is_consistent(word: str, effects: dict[str, Any]) -> None:
    """Y, Z, mu and with them the temperature follow the stage: differences of the residual see the same."""
    model, bearing, state, h, load, _ = case(word, **effects)
    compiled = model.stack(bearing)
    flat = effects.get("dimension") == "planar"
    angles = [1] if flat else [0, 1]
    q, v, a = (np.ascontiguousarray(x) for x in (state.q, state.v, state.a))
    f, external = np.ascontiguousarray(0.5 * h), np.r_[load.force, load.moment]
    cq, cv, ca, beta = 1e-3, 1.0, 1e3, 1e-3
    heat = {"memory": np.array([10.0, 60.0, 5.0, 0.0]), "gain": 0.05} if word == "pvt" else {}

    def at(x: Array) -> Any:
        d = np.zeros_like(q)
        d[:, angles] = x.reshape(-1, len(angles))
        out = compiled.condensed(
            q + cq * d, v + cv * d, a + ca * d, f, np.zeros((3, 6)), external, cq, cv, ca, beta, **heat
        )
        assert out[0] == "ok"
        return out

    x = np.zeros(4 * len(angles))
    want = differences(lambda y: at(y)[1], x, np.full(len(x), 1e-5))
    found = at(x)[2]
    assert np.abs(found - want).max() < 1e-6 * np.abs(want).max()


@pytest.mark.parametrize(
    ("word", "law"),
    thinned([*((word, "report") for word in LAWS), ("pvt", "plastic")], lambda word, law: law == "plastic"),
)
def test_jacobians_of_the_reports_balances(word: str, law: str) -> None:
    model, bearing, state, h, load, _ = case(word, bouc_wen=law)
    rng = np.random.default_rng(3)
    u = np.r_[rng.uniform(-5, 5, 12), rng.uniform(-0.1, 0.1, 8), rng.uniform(8e3, 1.2e4, 4)]
    given = inputs(state, load)
    found = model.jacobian(bearing, state.q, state.v, h, u, **given)
    want = differences(
        lambda y: model.residual(bearing, state.q, state.v, h, y, **given), u, np.where(np.abs(u) > 1e3, 10.0, 1e-3)
    )
    assert np.abs(found - want).max() < 1e-7 * np.abs(want).max()


# ---- runs -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [0.04, 0.8])
def test_velocity_decides_the_plateau(frequency: float) -> None:
    """Wherever a surface slides, mu is that of its velocity; slow and fast strokes differ as the law says."""
    scene = scene_of("fenz-test2", {"dimension": "planar"}, motion=Motion.harmonic(0.025, frequency))
    scene = slowed(scene, rate=50.0)
    rows = simulate(scene).history
    mu = np.array([s.friction for s in scene.bearing.surfaces])
    slides = (rows.friction_state**2).sum(-1) > 0.98
    speed = np.hypot(*np.moveaxis(rows.slip_velocity, -1, 0))
    along = (rows.friction_state * rows.slip_velocity).sum(-1) > 0
    assert (slides & along).any()
    want = reference.velocity(mu, mu / 2, 50.0, speed)
    assert rows.friction_coefficient is not None
    assert np.abs(rows.friction_coefficient / want - 1)[slides & along].max() < 0.02
    share = (rows.friction_coefficient / mu).max()
    assert share < 0.8 if frequency < 0.1 else share > 0.95


def test_neutral_numbers_are_constant_friction() -> None:
    scene = scene_of("fenz-test2", {"dimension": "planar"}, output_step=0.05, solver={"rtol": 1e-6})
    neutral = {"pressure_ratio": 1.0, "velocity_drop": 0.0, "temperature_ratio": 1.0}
    found = simulate(lawful(scene, "pvt", reference_pressure=P_REF, **neutral)).history
    want = simulate(scene).history
    assert want.friction_coefficient is None and want.temperature is None
    force = np.abs(want.top_force[:, 0]).max()
    assert np.abs(found.top_force - want.top_force)[:, 0].max() < 1e-3 * force
    mu = np.array([s.friction for s in scene.bearing.surfaces])
    assert found.friction_coefficient == pytest.approx(np.broadcast_to(mu, (len(found.time), 4)), rel=1e-12)


@cache
def fluxes(surface: int) -> tuple[Array, Array, Array]:
    """Time, recorded temperature, and the heat flux from the recorded friction, force and slip, of `heated()`."""
    run = heated()
    rows, R = run.history, run.scene.bearing.surfaces[surface].radius
    assert rows.temperature is not None and rows.friction_coefficient is not None
    v = reference.sliding_velocity(rows.friction_state, rows.slip_velocity)[:, surface]
    cover = reference.cover(R * np.sin(rows.sliding[:, surface] / R), RADIUS)
    q = rows.friction_coefficient[:, surface] * rows.normal_force[:, surface] / (np.pi * RADIUS**2) * v * cover
    return rows.time, rows.temperature[:, surface], q


@pytest.mark.parametrize(("surface", "least"), [(0, 20.0), (3, 50.0)])
def test_temperature_is_that_of_the_flux(surface: int, least: float) -> None:
    """A run integrates its exponential states as well as its angles."""
    time, temperature, flux = fluxes(surface)
    want = reference.temperature_by_states(time, flux, 18.0, 4.44e-6, 20.0, HEAT_KERNEL)
    rise = want.max() - 20.0
    assert rise > least, "this would not see the heat"
    assert np.abs(temperature - want).max() < 3e-4 * rise


@pytest.mark.parametrize("surface", thinned(range(4), lambda surface: surface == 0))
def test_states_are_the_convolution_within_the_bound(surface: int) -> None:
    """Against Duhamel's integral over all pairs of times; the flux of a run, which starts and stops at once."""
    time, _, flux = fluxes(surface)
    want = reference.temperature(time, flux, 18.0, 4.44e-6, 20.0)
    found = reference.temperature_by_states(time, flux, 18.0, 4.44e-6, 20.0, HEAT_KERNEL)
    onset = np.sqrt(4.44e-6 / np.pi) / 18.0 * reference.change_within(time, flux, SHORTEST)
    bound = HEAT_ERROR * (want - 20.0) + HEAT_ONSET * onset
    assert (np.abs(found - want) <= bound + 1e-9).all()
    assert bound.max() < 0.012 * (want.max() - 20.0), "a bound that says nothing"


@pytest.mark.parametrize(
    "effects", thinned([{}, {"dimension": "spatial", "bouc_wen": "isotropic"}], lambda effects: not effects), ids=str
)
def test_heat_is_fed_by_what_friction_loses(effects: dict[str, str]) -> None:
    assert heated(**effects).summary["energy"]["closure_error"] < 1e-3


@pytest.mark.slow
def test_planar_and_spatial_runs_agree() -> None:
    flat, full = heated().history, heated(dimension="spatial").history
    for name in ("temperature", "friction_coefficient"):
        assert getattr(flat, name).max(0) == pytest.approx(getattr(full, name).max(0), rel=2e-3)
    assert np.abs(flat.top_force[:, 0]).max() == pytest.approx(np.abs(full.top_force[:, 0]).max(), rel=1e-3)


def test_temperatures_do_not_shorten_the_steps() -> None:
    """Their error is of the order of the method: without its first stage the estimate asks for 14 times the steps."""
    assert heated().counters.steps < 12_000


def test_all_methods_agree() -> None:
    scene = scene_of(
        "fenz-test2", {"dimension": "planar"}, motion=Motion.harmonic(0.02, 1.0, cycles=0.5), output_step=0.01
    )
    scene = lawful(scene, "pvt", reference_pressure=P_REF)
    runs = [
        simulate(replace(scene, solver=Solver(method=method, rtol=1e-6))).history for method in ("implicit", "esdirk4")
    ]
    for name in ("top_force", "temperature", "friction_coefficient"):
        first, *others = (getattr(run, name) for run in runs)
        for other in others:
            assert np.abs(first - other)[1:].max() < 2e-3 * np.ptp(first, axis=0).max(), name
    explicit = failure_of(replace(scene, solver=Solver(method="dopri5", rtol=1e-5)))
    assert explicit.status == "stiff", "friction that follows velocity relaxes faster than it can step"


@pytest.mark.slow
@pytest.mark.parametrize("solver", [{}, {"rtol": 1e-3}])
@pytest.mark.parametrize("word", ["report", "isotropic"])
def test_friction_that_grows_with_velocity_never_pushes(word: str, solver: dict[str, Any]) -> None:
    """With |slip| for the velocity this record stops: a light slider runs away while its surface unloads."""
    run = simulate(slowed(scene_of("ridgecrest-clc", {"bouc_wen": word}, solver, duration=16.0)))
    assert run.history.normal_force.max() < 2e5


COMPILED: tuple[dict[str, Any], ...] = (
    {"friction": "pvt", "dimension": "planar", "uplift": True},
    {"friction": "velocity", "spin": "free", "rims": False},
    {"friction": "custom", "spin": "patch", "sliders": "massless"},
    {"friction": "pvt", "bouc_wen": "isotropic", "uplift": True},
)


@pytest.mark.parametrize("effects", thinned(COMPILED, lambda effects: effects["friction"] == "custom"), ids=str)
def test_models_with_a_law_compile_without_a_warning(effects: dict[str, Any], tmp_path: Any) -> None:
    assert warnings_of({**effects, **LAWS[effects["friction"]]}, tmp_path, "-fsyntax-only") == ""


# ---- heat as exponentials -------------------------------------------------------------------------------------------


def test_sum_of_exponentials_is_within_its_bound() -> None:
    rate, weight = np.array(HEAT_KERNEL).T
    t = np.geomspace(SHORTEST, LONGEST, 20000)
    kernel = (weight * np.exp(-np.outer(t, rate))).sum(1)
    assert np.abs(kernel * np.sqrt(t) - 1).max() < HEAT_ERROR
    assert (weight * (1 - np.exp(-rate * SHORTEST)) / rate).sum() == pytest.approx(2 * np.sqrt(SHORTEST), rel=1e-6)
    assert (weight >= 0).all()
    root = (np.arange(20000) + 0.5) / 20000 * np.sqrt(SHORTEST)  # of tau, so that 1/sqrt(tau) d tau is 2 d root
    error = 1 - root * (weight * np.exp(-np.outer(root**2, rate))).sum(1)
    assert np.abs(error).sum() * np.sqrt(SHORTEST) / 20000 == pytest.approx(HEAT_ONSET, rel=0.02)


# ---- what is stored, refused and left out ---------------------------------------------------------------------------


def test_results_and_scenes_come_back(tmp_path: Any) -> None:
    run = heated()
    text = scene_text(run.scene)
    import tomllib

    assert scene_from_table(tomllib.loads(text)).bearing == run.scene.bearing
    again = load_result(run.to_netcdf(tmp_path / "run.nc"))
    assert again.scene.effects == run.scene.effects
    assert (again.history.temperature == run.history.temperature).all()
    assert (again.history.friction_coefficient == run.history.friction_coefficient).all()
    assert run.dataset["temperature"].attrs["units"] == "degC" and "friction_coefficient" in run.dataset
    cold = simulate(scene_of("fenz-test2", duration=1.0))
    assert "temperature" not in cold.dataset and cold.to_netcdf(tmp_path / "cold.nc")
    assert load_result(tmp_path / "cold.nc").history.temperature is None


def test_constant_friction_emits_nothing_of_a_law() -> None:
    files = generate(ModelSpec(Layout.tfp())).files
    for word in ("MSFP_LAW", "MSFP_MEMORY", "coefficient[", "source", "memory"):
        assert word not in files["msfp_kernels.h"], word
    header = files["msfp_model.h"]
    assert "#define MSFP_LAW 0 " in header and "#define MSFP_MEMORY 0 " in header
    assert "coefficient[" not in header and "MSFP_SURFACE_PARAMETERS_HEATING" not in header
    heated = ModelSpec(Layout.tfp(), Effects(friction="pvt"))
    assert "#define MSFP_MEMORY 14 " in generate(heated).files["msfp_model.h"]
    assert "memory.c" in runtime_sources(heated) and "memory.c" not in runtime_sources(ModelSpec(Layout.tfp()))


def worn(**solver: Any) -> Scene:
    """A law of the path of sliding: friction falls by 30 % over some decimetres."""
    scene = scene_of(
        "fenz-test2", {"dimension": "planar"}, {"rtol": 1e-6, **solver}, motion=Motion.harmonic(0.025, 0.2)
    )
    scene = lawful(scene, "custom", "mu * (1 - c1 * (1 - exp(-s / c2)))", c1=0.3, c2=0.05)
    return replace(scene, output_step=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["implicit", "esdirk4"])
def test_friction_by_the_path_of_sliding(method: str, tmp_path: Path) -> None:
    """The path is the integral of the sliding velocity, and friction that of the formula."""
    scene = worn(method=method)
    run = simulate(scene)
    rows = run.history
    assert (
        run.succeeded and rows.memory is not None and rows.friction_coefficient is not None and rows.temperature is None
    )
    v = reference.sliding_velocity(rows.friction_state, rows.slip_velocity)
    path = np.vstack([np.zeros(4), np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(rows.time)[:, None], axis=0)])
    assert path[-1].max() > 0.15
    assert np.abs(rows.memory - path).max() < 2e-3 * path.max()
    mu = np.array([surface.friction for surface in scene.bearing.surfaces])
    want = mu * (1 - 0.3 * (1 - np.exp(-rows.memory / 0.05)))
    assert np.abs(rows.friction_coefficient / want - 1).max() < 1e-6
    assert run.dataset["memory"].dims == ("time", "surface")
    assert load_result(run.to_netcdf(tmp_path / "run.nc")).history.memory == pytest.approx(rows.memory)


def test_a_law_takes_one_memory() -> None:
    with pytest.raises(InputError, match="one memory of the surface at most; leave out one of T, s"):
        Effects(friction="custom", friction_law="mu * (1 - c1 * tanh(s / c2 + T / c3))")


def test_formula_is_part_of_the_models_name() -> None:
    one, other = (
        Effects(friction="custom", friction_law=text) for text in ("mu*(1-c1*exp(-c2*v))", " mu * (1 - c1*exp(-c2*v) )")
    )
    assert one == other and hash(one) == hash(other) and pickle.loads(pickle.dumps(one)) == one
    assert ModelSpec(Layout.dfp(), one).key.endswith("custom[mu*(1-c1*exp(-c2*v))]")


def test_other_refusals() -> None:
    with pytest.raises(InputError, match=r"friction_law is missing"):
        Effects(friction="custom")
    with pytest.raises(InputError, match=r"has a formula of its own"):
        Effects(friction="velocity", friction_law="mu")
    run = heated()
    model = model_of((5, 2, 2), friction="pvt", dimension="planar")
    with pytest.raises(InputError, match=r"as_ode: .*has temperatures"):
        model.as_ode(run.scene.bearing, run.scene.motion, run.scene.top)
    with pytest.raises(InputError, match=r"duration = 2000: .*for 1000 s"):
        replace(run.scene, motion=Motion.harmonic(0.1, 0.001), duration=2000.0)
    with pytest.raises(InputError, match=r"temperature: .*depends on none"):
        bearing, zero = scene_of("fenz-test2").bearing, np.zeros((4, 3))
        model_of((5, 2, 2)).evaluate(bearing, zero, zero, np.zeros((4, 2)), temperature=[0] * 4)


def test_laws_are_found_by_their_word() -> None:
    assert law_of("constant") is None and set(BUILT_IN) == {"velocity", "pv", "pvt", "pvtd"}
    assert [law.word for law in BUILT_IN.values() if law.depends_on_temperature] == ["pvt", "pvtd"]


def test_without_heat_the_law_is_that_of_the_start() -> None:
    given = {**BUILT_IN["pvt"].parameters, "reference_pressure": 15e6, "start_temperature": 80.0, "mu": 0.1}
    at = {**{name: value for name, value in given.items() if value is not None}, "v": 0.02, "p": 40e6}
    cold = coefficient(BUILT_IN["pv"], at)[0]
    assert cold == pytest.approx(float(coefficient(BUILT_IN["pvt"], {**at, "T": 80.0})[0]), rel=1e-14)
    assert cold == pytest.approx(0.1 * reference.kp(40e6, 15e6) * reference.kv(0.02) * reference.kt(80.0), rel=1e-3)


# ---- a law beyond the range in which it was checked -----------------------------------------------------------------


def falling_law(speed: float, method: str = "implicit", zero: float = 2.5) -> Scene:
    """mu (1 - exp(v - zero)), below zero beyond that velocity [m/s], for a base that reaches `speed` [m/s]."""
    unit = Motion.harmonic(1.0, 16.0, cycles=0.5)
    motion = Motion.harmonic(speed / np.abs(unit.velocity(unit.knots)).max(), 16.0, cycles=0.5)
    scene = scene_of("fenz-test2", {"dimension": "planar"}, {"method": method}, motion=motion)
    return lawful(replace(scene, duration=None), "custom", FORMULA, c1=np.exp(-zero), c2=-1.0, c3=1e9)


@pytest.mark.parametrize("method", ["implicit", "esdirk4", "dopri5"])
def test_a_coefficient_below_zero_ends_the_run(method: str) -> None:
    error = failure_of(falling_law(5.0, method))
    assert error.status == "law" and "friction coefficient = -" in str(error) and "below zero" in str(error)
    assert isinstance(error.result, Result)
    history = error.result.history
    assert history.friction_coefficient is not None and history.friction_coefficient.min() >= 0
    assert np.diff(history.energy["friction_dissipated"]).min() > -1e-9
    assert np.linalg.norm(history.slip_velocity, axis=2).max() == pytest.approx(2.5, rel=1e-3)


def test_a_velocity_beyond_the_checked_range_is_noted() -> None:
    noted = [note for note in simulate(falling_law(2.6, zero=10.0)).notes if note.kind == "law_speed"]
    assert len(noted) == 1 and noted[0].value > 2.0 and "checked up to 2 m/s" in noted[0].line
    assert noted[0].surface in (1, 4)  # the outer surfaces slide
    assert not [note for note in simulate(falling_law(1.0, zero=10.0)).notes if note.kind.startswith("law")]


def test_a_force_and_a_temperature_beyond_the_checked_range_are_noted() -> None:
    """With the surface that leaves the range, here the third alone."""
    scene = scene_of("fenz-test2", {"dimension": "planar"}, duration=2.0)
    heavy = lawful(scene, "pvt", reference_pressure=P_REF, patch_radius=[0.05, 0.05, 0.01, 0.05])
    notes = {note.kind: note for note in simulate(heavy).notes}
    assert notes["law_load"].value > 2e8 * np.pi * 0.01**2 and notes["law_load"].surface == 3
    hot = lawful(scene, "pvt", reference_pressure=P_REF, start_temperature=[20.0, 20.0, 601.0, 20.0])
    notes = {note.kind: note for note in simulate(hot).notes}
    assert notes["law_temperature"].value > 600 and notes["law_temperature"].surface == 3


def test_one_evaluation_refuses_a_coefficient_below_zero() -> None:
    scene = falling_law(1.0)
    model = build_model(scene.bearing.layout, scene.modelled)
    rates, state = np.zeros((4, 3)), np.zeros((4, 2))
    rates[0, 1], state[0, 0] = 7.0, -1.0
    with pytest.raises(RunError, match="below zero"):
        model.evaluate(scene.bearing, np.zeros((4, 3)), rates, state, top_force=(0, 0, -112e3))
