"""Response spectra against closed forms and an independent integration; scaling to targets."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import thinned

from msfp_gen import InputError, Motion, load_scene
from msfp_gen.motions.records import (
    Record,
    ScaleTo,
    asce7_spectrum,
    baseline_corrected,
    bundled,
    read_record,
    response_spectrum,
)
from msfp_gen.motions.records.record_tables import arias_intensity, significant_duration
from msfp_gen.motions.records.spectrum import MEASURES

G = 9.80665


@cache
def quake():
    return baseline_corrected(bundled("ridgecrest-2019-ci-clc"), duration=30.0)


def motion_of(values, step=0.01):
    """A motion whose acceleration is linear between the samples of the first component."""
    rows = np.zeros((len(values), 3))
    rows[:, 0] = values
    return Motion.from_acceleration(step * np.arange(len(values)), rows)


def of(spectrum, name, what="psa"):
    return getattr(spectrum, what)[:, MEASURES.index(name)]


@pytest.mark.parametrize(("ratio", "damping"), [(0.3, 0.05), (1.0, 0.05), (1.0, 0.2), (2.5, 0.01)])
def test_a_long_harmonic_gives_the_steady_state(ratio, damping):
    """SD of a0 sin(w t), slowly grown and slowly ended, is a0/w0^2 times the dynamic amplification."""
    period = 0.8
    omega = 2 * np.pi / (ratio * period)
    t = np.arange(0, 200 * period, 0.005)
    ramped = np.minimum(1, np.minimum(t, t[-1] - t) / (60 * period)) * np.sin(omega * t)
    found = response_spectrum(motion_of(ramped, 0.005), [period], damping=damping)
    r = omega * period / (2 * np.pi)
    exact = 1 / np.hypot(1 - r**2, 2 * damping * r)
    assert of(found, "E1")[0] == pytest.approx(exact, rel=5e-3)


def test_a_step_overshoots_as_the_closed_form_says():
    """u_max = a/w^2 (1 + exp(-pi z/sqrt(1 - z^2))); the step lasts until after the peak."""
    period, damping = 1.0, 0.05
    found = response_spectrum(motion_of(np.ones(400)), [period], damping=damping)
    overshoot = np.exp(-np.pi * damping / np.sqrt(1 - damping**2))
    assert of(found, "E1", "sd")[0] == pytest.approx((period / (2 * np.pi)) ** 2 * (1 + overshoot), rel=2e-3)


@pytest.mark.parametrize(
    ("period", "component"),
    thinned(product([0.05, 0.7, 8.0], [0, 1]), lambda *case: case in ((0.7, 1), (8.0, 0))),
)
def test_a_real_record_against_an_independent_integration(period, component):
    motion = quake()
    w, z = 2 * np.pi / period, 0.05
    ground = motion.acceleration[:, component]

    def rate(t, y):
        return [y[1], -2 * z * w * y[1] - w * w * y[0] - np.interp(t, motion.time, ground, right=0.0)]

    step = min(0.01, period / 25)
    run = solve_ivp(rate, (0, motion.time[-1] + period), [0, 0], max_step=step, rtol=1e-6, atol=1e-10)
    found = response_spectrum(motion, [period]).sd[0, component]
    assert found == pytest.approx(np.abs(run.y[0]).max(), rel=3e-3)


def test_very_stiff_and_very_soft_oscillators_feel_the_ground():
    """PSA tends to the peak acceleration, SD to the peak displacement of the ground."""
    found = response_spectrum(quake(), [0.002, 300.0])
    np.testing.assert_allclose(found.psa[0, :3], found.pga[:3], rtol=0.02)
    np.testing.assert_allclose(found.sd[1, :3], np.abs(quake().displacement).max(axis=0), rtol=0.06)


def test_sources_of_one_motion_agree():
    """A motion is taken at its samples: between them its peaks would be cut, of this record by 8 %."""
    periods = [0.02, 0.05, 0.3, 1.0, 3.0]
    corrected = response_spectrum(quake(), periods)
    motion = Motion.from_record(bundled("ridgecrest-2019-ci-clc"), duration=30.0)
    for source in (motion, motion.held(0.0317)):
        found = response_spectrum(source, periods)
        np.testing.assert_allclose(found.psa, corrected.psa, rtol=1e-6)
        np.testing.assert_allclose(found.pga, corrected.pga, rtol=1e-6)
    assert corrected.damping == 0.05 and corrected.sd.shape == (5, 6)
    np.testing.assert_allclose(corrected.psv**2, corrected.psa * corrected.sd, rtol=1e-12)


def test_measures_of_a_motion_in_one_direction():
    """Along azimuth b each direction at angle c to it sees |cos c| of the peak: RotD50 is cos 45, RotD100 all of it."""
    values, b = np.random.default_rng(1).normal(size=800), np.radians(30)
    along = np.outer(values, [np.cos(b), np.sin(b), 0.0])
    found = response_spectrum(Record("line", 0.01, along + 0.1), [0.5])
    peak = np.hypot(of(found, "E1"), of(found, "E2"))[0]
    assert of(found, "rotd100")[0] == pytest.approx(peak, rel=1e-9)
    assert of(found, "rotd50")[0] == pytest.approx(peak * np.cos(np.pi / 4), rel=0.01)
    assert of(found, "geomean")[0] == pytest.approx(peak * np.sqrt(np.cos(b) * np.sin(b)), rel=1e-9)


def test_rotd_against_every_angle_one_by_one():
    a = quake().acceleration
    angles = np.radians(np.arange(180))
    peaks = [np.abs(a[:, 0] * np.cos(c) + a[:, 1] * np.sin(c)).max() for c in angles]
    found = dict(zip(MEASURES, response_spectrum(quake(), [1.0]).pga, strict=True))
    assert found["rotd50"] == pytest.approx(np.median(peaks)) and found["rotd100"] == pytest.approx(max(peaks))


def test_spectrum_as_csv(tmp_path):
    found = response_spectrum(quake(), [0.5, 1.0])
    path = found.to_csv(tmp_path / "s.csv")
    head = path.read_text().splitlines()
    assert head[0] == "# response spectrum, damping 0.05"
    assert head[1].startswith("period [s], PSA_E1 [m/s^2], ") and head[1].endswith("SD_rotd100 [m]")
    rows = np.loadtxt(path, delimiter=",", skiprows=2)
    np.testing.assert_array_equal(rows[:, 1:7], found.psa)


@pytest.mark.parametrize(
    ("periods", "damping", "message"),
    [
        ([0.0], 0.05, "periods"),
        ([], 0.05, "periods"),
        ([[1.0]], 0.05, "periods"),
        ([np.nan], 0.05, "periods"),
        ([1.0], 0.0, "damping"),
        ([1.0], 1.0, "damping"),
        ([1.0], np.nan, "damping"),
    ],
)
def test_bad_spectra_are_refused(periods, damping, message):
    with pytest.raises(InputError, match=message):
        response_spectrum(quake(), periods, damping=damping)


def test_the_design_spectrum_has_the_ordinates_of_asce_7():
    """S_DS = 1.0, S_D1 = 0.6, T_L = 8: T_0 = 0.12 s, T_S = 0.6 s."""
    found = asce7_spectrum([0.0, 0.06, 0.12, 0.3, 0.6, 1.0, 2.0, 8.0, 16.0], 1.0, 0.6)
    np.testing.assert_allclose(found, [0.4, 0.7, 1.0, 1.0, 1.0, 0.6, 0.3, 0.075, 0.01875])


@pytest.mark.parametrize("component", MEASURES)
def test_scaling_to_a_peak_and_to_an_ordinate(component):
    factor = ScaleTo(pga=3.0, component=component).factor(quake())
    assert response_spectrum(quake().scaled(factor), [1.0]).pga[MEASURES.index(component)] == pytest.approx(3.0)
    factor = ScaleTo(sa=2.0, period=1.7, component=component).factor(quake())
    assert of(response_spectrum(quake().scaled(factor), [1.7]), component)[0] == pytest.approx(2.0)


def test_scaling_to_a_design_spectrum_is_the_least_squares_of_logarithms():
    target = ScaleTo(sds=9.8, sd1=5.9, between=(0.5, 4.0))
    best = target.factor(quake())
    periods = np.geomspace(0.5, 4.0, 100)
    ordinates = of(response_spectrum(quake(), periods), "rotd50")

    def misfit(factor):
        return np.sum(np.log(factor * ordinates / asce7_spectrum(periods, 9.8, 5.9)) ** 2)

    assert misfit(best) < min(misfit(0.999 * best), misfit(1.001 * best))


def test_all_components_get_one_factor_and_the_motion_says_which():
    record = bundled("ridgecrest-2019-ci-clc")
    plain = Motion.from_record(record, duration=30.0)
    scaled = Motion.from_record(record, duration=30.0, scale_to=ScaleTo(pga=2.0))
    factor = scaled.metadata["scale"]
    assert scaled.metadata["scaled_to"] == "rotd50 peak acceleration 2 m/s^2"
    np.testing.assert_allclose(scaled.displacement(17.0), factor * plain.displacement(17.0), rtol=1e-9)
    with pytest.raises(InputError, match="scale = 2: scale_to is given too"):
        Motion.from_record(record, duration=30.0, scale=2, scale_to=ScaleTo(pga=2.0))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "nothing given; give pga, or sa and period, or sds, sd1 and between"),
        ({"pga": 1.0, "sa": 1.0}, "pga, sa given"),
        ({"sa": 1.0}, "sa given"),
        ({"sds": 1.0, "sd1": 0.6}, "sds, sd1 given"),
        ({"sds": 1.0, "sd1": 0.6, "between": (4.0, 0.5)}, "scale_to.between = .*shorter period first"),
        ({"pga": -1.0}, "scale_to.pga = -1.0: give a finite number above 0"),
        ({"pga": 1.0, "component": "x"}, "scale_to.component = 'x'"),
    ],
)
def test_bad_targets_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        ScaleTo(**given)


def test_a_component_that_is_not_there_cannot_be_scaled():
    with pytest.raises(InputError, match=r"scale_to\.component = 'E3': the motion has none"):
        ScaleTo(pga=1.0, component="E3").factor(motion_of(np.sin(np.arange(100.0))))


def test_targets_from_text():
    assert ScaleTo.parse("sa=0.5 g, period = 2500 ms") == ScaleTo(sa=0.5 * G, period=2.5)
    assert ScaleTo.parse("sds=1 g,sd1=6,between=0.5:4,component=E1") == ScaleTo(
        sds=G, sd1=6.0, between=(0.5, 4.0), component="E1"
    )
    for text, message in {"pga": "'pga'; give name=value", "pgx=1": "'pgx=1'", "pga=1 gram": "scale_to.pga"}.items():
        with pytest.raises(InputError, match=message):
            ScaleTo.parse(text)


def scene_text(motion):
    return f"""
        bearing = "fenz-tfp"
        [top]
        kind = "rig"
        axial_load = "112 kN"
        stiffness = "100 kN/mm"
        [motion]
        kind = "record"
        {motion}
    """


def test_scene_files_scale_and_correct(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(
        scene_text(
            'bundled = "ridgecrest-2019-ci-clc"\nduration = "30 s"\ncorner = "0.1 Hz"\ntaper = 2.0\n'
            '[motion.scale_to]\nsa = "0.2 g"\nperiod = 2.0\ncomponent = "rotd100"'
        )
    )
    scene = load_scene(path)
    assert "0.1 Hz" in scene.motion.metadata["correction"] and "over 2 s" in scene.motion.metadata["correction"]
    assert of(response_spectrum(scene.motion, [2.0]), "rotd100")[0] == pytest.approx(0.2 * G, rel=1e-6)
    from msfp_gen.scene.file.loader import scene_text as written

    path.write_text(written(scene))
    assert load_scene(path).motion == scene.motion


def test_scene_files_join_components_and_take_them_as_they_are(tmp_path):
    from support import record_writers as w

    for name, values, last in zip("abc", quake().acceleration.T, ("090", "000", "UP"), strict=True):
        (tmp_path / f"{name}.AT2").write_text(w.peer(values, last=last))
    path = tmp_path / "scene.toml"
    path.write_text(scene_text('file = ["a.AT2", "b.AT2", "c.AT2"]\ncorrect = false'))
    motion = load_scene(path).motion
    np.testing.assert_allclose(motion.acceleration(10.0), quake().acceleration[1000], atol=1e-5)
    assert motion.metadata["correction"].startswith("none") and "a.AT2, b.AT2" in motion.metadata["file"]
    assert read_record(*(tmp_path / f"{n}.AT2" for n in "abc")).channels[2].endswith("UP")


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ('bundled = "ridgecrest-2019-ci-clc"\nscale_to = { pga = "2 g", pgx = 1 }', "motion.scale_to.pgx: unknown key"),
        ('bundled = "ridgecrest-2019-ci-clc"\nscale_to = { pga = "2 mm" }', "motion.scale_to.pga = '2 mm'"),
        ('bundled = "ridgecrest-2019-ci-clc"\nscale_to = 3', "motion.scale_to = 3: give a table"),
        ('bundled = "ridgecrest-2019-ci-clc"\nscale_to = { sa = 1.0 }', "motion.scale_to: sa given"),
        ('bundled = "ridgecrest-2019-ci-clc"\nduration = 60\ncorrect = false', "motion.correct: .*drifts"),
        ("file = []", r"motion.file = \[\]: give a text in quotes, or a list"),
        ('file = ["a.AT2", 3]', "motion.file = .*give a text in quotes, or a list"),
        ('file = ["a.AT2"]', "a.AT2': no such file"),
    ],
)
def test_bad_record_tables_are_refused_in_one_line(motion, message, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(scene_text(motion))
    with pytest.raises(InputError, match=message) as caught:
        load_scene(path)
    assert "\n" not in str(caught.value)


def test_arias_intensity_and_duration_of_a_constant():
    t = np.linspace(0, 10, 1001)
    a = np.full((1001, 1), 2.0)
    assert arias_intensity(t, a)[-1] == pytest.approx(np.pi / (2 * G) * 4 * 10)
    assert significant_duration(t, a) == pytest.approx(9.0)
    assert significant_duration(t, 0 * a) == 0
