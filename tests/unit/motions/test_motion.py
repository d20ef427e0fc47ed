"""The base motion: smoothness at every knot, exactness between them, and what is refused."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from msfp_gen.common.errors import InputError
from msfp_gen.motions import piecewise
from msfp_gen.motions.motion import Motion
from msfp_gen.motions.prescribed import Load
from msfp_gen.motions.records import bundled

TIME = np.linspace(0.0, 6.0, 61)
WAVY = np.stack([np.sin(TIME) ** 2, 0.3 * np.cos(2 * TIME), 0.1 * TIME**2], axis=1)


@pytest.fixture(scope="module")
def every(tmp_path_factory):
    """One motion from each constructor and operation."""
    table = tmp_path_factory.mktemp("motion") / "table.csv"
    table.write_text(
        "time [s], u1 [mm]\n" + "".join(f"{t:.3f}, {u:.6f}\n" for t, u in zip(TIME, WAVY[:, 0], strict=True))
    )
    harmonic = Motion.harmonic(0.025, 0.04)
    return {
        "from_arrays": Motion.from_arrays(TIME, WAVY, 1e-2 * WAVY),
        "from_acceleration": Motion.from_acceleration(TIME, WAVY),
        "harmonic": harmonic,
        "harmonic, long lead-in": Motion.harmonic(0.14, 0.0072, lead_in=300.0, direction=1.0),
        "circle": Motion.circle(0.125, 0.1),
        "figure_eight": Motion.figure_eight(0.125, 0.1),
        "ramp": Motion.ramp(0.1, 2.5, direction=0.4),
        "from_record": Motion.from_record(bundled("ridgecrest-2019-ci-clc"), duration=60.0, scale=0.5),
        "from_csv": Motion.from_csv(table),
        "held": harmonic.held(5.0),
        "rotated": harmonic.rotated(2.0),
        "sum": harmonic + Motion.harmonic(0.01, 0.08, cycles=4.25, lead_in=2.5 / 0.8, direction=1.3),
    }


KINDS = (
    "from_arrays",
    "from_acceleration",
    "harmonic",
    "harmonic, long lead-in",
    "circle",
    "figure_eight",
    "ramp",
    "from_record",
    "from_csv",
    "held",
    "rotated",
    "sum",
)


@pytest.mark.parametrize("kind", KINDS)
def test_displacement_velocity_and_acceleration_are_continuous(every, kind):
    motion = every[kind]
    h = np.diff(motion.knots)
    inner = motion.knots[1:-1]
    for d in range(3):
        # The polynomial of each piece at its own end, written out, against its successor at the knot.
        powers = np.polynomial.polynomial.polyder(np.moveaxis(motion.coefficients, -1, 0), d, axis=0)
        ends = sum(p * h[:, None] ** k for k, p in enumerate(powers))[:-1]
        free = ~np.isin(inner, motion.jumps) if d == 2 else np.ones(len(inner), bool)
        scale = np.max(np.abs(powers[0]), axis=0) + 1e-12
        assert np.all(np.abs(ends - motion.evaluate(inner, d))[free] <= 1e-8 * scale)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_displacement(every, kind):
    motion = every[kind]
    middle = (motion.knots[1:] + motion.knots[:-1]) / 2
    eps = 1e-3 * np.min(np.diff(motion.knots))
    for d in (0, 1):
        slope = (motion.evaluate(middle + eps, d) - motion.evaluate(middle - eps, d)) / (2 * eps)
        exact = motion.evaluate(middle, d + 1)
        rounding = 1e-15 * np.max(np.abs(motion.evaluate(middle, d))) / eps
        np.testing.assert_allclose(slope, exact, rtol=0, atol=1e-5 * np.max(np.abs(exact)) + rounding)


@pytest.mark.parametrize("kind", KINDS)
def test_starts_at_zero_and_pickles(every, kind):
    motion = every[kind]
    assert motion.resolution
    copy = pickle.loads(pickle.dumps(motion))
    assert vars(copy)["resolution"].steps.tolist() == motion.resolution.steps.tolist(), "it is not derived again"
    assert copy == motion and hash(copy) == hash(motion) and copy.metadata == motion.metadata
    assert not copy.coefficients.flags.writeable
    assert motion.knots[0] == 0
    assert all(type(v) in (str, float) for v in motion.metadata.values())
    assert motion != motion + motion


@pytest.mark.parametrize("lead_in", [None, 3.0, 40.0])
def test_harmonic_misses_its_formula_by_less_than_1e_9(lead_in):
    a, f = 0.025, 0.04
    motion = Motion.harmonic(a, f, lead_in=lead_in)
    rise = 1 / (4 * f) if lead_in is None else lead_in
    t = np.linspace(0, motion.duration, 50021)
    x = np.minimum(t / rise, 1)
    exact = a * x**3 * (10 - 15 * x + 6 * x**2) * np.sin(2 * np.pi * f * t)
    assert motion.duration == pytest.approx(rise + 2 / f)
    assert np.max(np.abs(motion.displacement(t)[:, 0] - exact)) < 1e-9 * a
    if lead_in is None:
        late = t[t >= rise]
        report = a * np.cos(2 * np.pi * f * (late - rise))
        np.testing.assert_allclose(motion.displacement(late)[:, 0], report, atol=1e-9 * a)


@pytest.mark.parametrize(("make", "multiple"), [(Motion.circle, 1), (Motion.figure_eight, 2)])
def test_orbits_miss_their_formula_by_less_than_1e_9(make, multiple):
    a, omega = 0.125, 0.1
    motion = make(a, omega)
    t = np.linspace(0, motion.duration, 40009)
    x = np.minimum(t / 20.0, 1)
    s = x**3 * (10 - 15 * x + 6 * x**2)
    exact = a * np.stack([s * np.cos(omega * t), s * np.sin(multiple * omega * t)], axis=1)
    assert np.max(np.abs(motion.displacement(t)[:, :2] - exact)) < 1e-9 * a
    assert motion.duration == pytest.approx(20 + 4 * np.pi / omega)


def test_ramp_is_the_reports():
    motion = Motion.ramp(0.1, 3.0)
    np.testing.assert_allclose(motion.displacement([0.0, 1.0, 3.0])[:, 0], [0, 0.05, 0.45])


def test_piecewise_linear_acceleration_is_integrated_exactly():
    motion = Motion.from_acceleration([0.0, 1.0, 3.0, 4.0], [[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0.0]])
    assert motion.acceleration(0.5)[0] == pytest.approx(0.5, abs=1e-14)
    assert motion.velocity(4.0)[0] == pytest.approx(3.0, abs=1e-14)
    # 1/6, then 1/6 + 1/2*2 + 2, then + 5/2 + 1/2 - 1/6
    assert motion.displacement(4.0)[0] == pytest.approx(1 / 6 + 3 + 2.5 + 0.5 - 1 / 6, abs=1e-13)


def test_sampled_displacement_converges_with_the_fourth_order():
    errors = []
    for points in (41, 81):
        t = np.linspace(0, 4, points)
        u = np.stack([np.sin(3 * t), t, 0 * t], axis=1)
        fine = np.linspace(0, 4, 4001)
        errors.append(np.max(np.abs(Motion.from_arrays(t, u).displacement(fine)[:, 0] - np.sin(3 * fine))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.5)


def test_ends_at_rest_are_clamped_and_moving_ends_keep_their_velocity():
    t = np.linspace(0, np.pi, 101)
    rest = Motion.from_arrays(t, np.outer(1 - np.cos(t), [1, 0, 0]))
    assert rest.metadata["initial_speed"] == 0
    assert rest.velocity(rest.duration)[0] == pytest.approx(0, abs=1e-12)
    moving = Motion.from_arrays(t, np.outer(np.sin(t), [1, 0, 0]))
    assert moving.metadata["initial_speed"] == pytest.approx(1, rel=1e-4)
    assert abs(moving.acceleration(0.0)[0]) < 1e-2  # no burst at the start


def test_a_late_first_time_moves_to_zero_and_is_remembered():
    motion = Motion.from_arrays(TIME + 12.0, WAVY)
    assert motion.duration == pytest.approx(6.0) and motion.metadata["start_time"] == 12.0


def test_held_stays_where_the_motion_ended():
    motion = Motion.harmonic(0.025, 0.04).held(7.0)
    assert motion.jumps.tolist() == [56.25] and motion.duration == 63.25
    np.testing.assert_array_equal(motion.displacement([56.25, 60.0, 63.25])[:, 0], motion.displacement(56.25)[0])
    assert not motion.velocity([57.0, 63.25]).any()
    with pytest.raises(InputError, match="ends with u_g1 moving"):
        Motion.circle(0.1, 0.1).held(1.0)


def test_a_component_that_is_rounding_does_not_move():
    """The cosine of a right angle is 6e-17; what is left of it at the end is no speed."""
    t = np.linspace(0.0, 2.0, 201)
    across = np.outer(np.sin(np.pi * t / 2.0) ** 4, [1e-17, 0.1, 0.0])
    across[:, 0] += 1e-18 * np.sin(7.0 * t)
    assert Motion.from_arrays(t, across).held(1.0).duration == 3.0


def test_a_record_ends_at_rest_and_is_held_without_a_jump(every):
    assert every["from_record"].held(20.0).jumps.size == 0
    assert every["from_record"].max_step == pytest.approx(0.02)


@pytest.mark.parametrize("azimuth", [0.0, 0.7, -1.2, np.pi / 2, 2.5])
def test_plane_of_a_straight_motion(azimuth):
    folded = azimuth - np.pi if azimuth > np.pi / 2 else azimuth
    assert Motion.harmonic(0.1, 0.5, direction=azimuth).plane() == pytest.approx(folded, abs=1e-12)


def test_plane_of_other_motions():
    zero = np.zeros_like(WAVY)
    up, east, north = (WAVY * row for row in np.eye(3)[[2, 0, 1]])
    assert Motion.circle(0.1, 0.1).plane() is None
    assert Motion.from_arrays(TIME, up).plane() == 0
    assert Motion.from_arrays(TIME, east + up, north).plane() == 0  # rocks about E2 only
    assert Motion.from_arrays(TIME, north + up, east).plane() == pytest.approx(np.pi / 2)
    assert Motion.from_arrays(TIME, east, east).plane() is None  # rocks out of its plane
    assert Motion.from_arrays(TIME, zero, up).plane() is None  # spins
    assert Motion.from_arrays(TIME, east + np.array([0, 5.0, 0])).plane() == 0  # an offset is no motion


def test_rotated_turns_the_horizontal_channels():
    motion = Motion.figure_eight(0.1, 0.5)
    t = np.linspace(0, motion.duration, 50)
    turned = motion.rotated(np.pi / 2).displacement(t)
    np.testing.assert_allclose(turned[:, 0], -motion.displacement(t)[:, 1], atol=1e-15)
    np.testing.assert_allclose(turned[:, 1], motion.displacement(t)[:, 0], atol=1e-15)
    with pytest.raises(InputError, match="rocks the base"):
        Motion.from_arrays(TIME, WAVY, WAVY).rotated(0.1)


@pytest.mark.parametrize("shift", [1e-15, -1e-15, 5e-10, -5e-10])
def test_durations_that_differ_by_rounding_add(shift):
    """Sums of steps in floating point: their ends are one time, in a sum of either order."""
    time, wave = np.linspace(0.0, 2.0, 21), np.sin(np.linspace(0, np.pi, 21))[:, None] ** 3
    one = Motion.from_arrays(time, wave * [0.01, 0.0, 0.0])
    other = Motion.from_arrays(time * (1 + shift / 2), wave * [0.0, 0.02, 0.0])
    for first, second in ((one, other), (other, one)):
        both = first + second
        assert both.duration == first.duration
        np.testing.assert_allclose(both.displacement(1.0), [0.01, 0.02, 0.0], atol=1e-9)
    with pytest.raises(InputError, match="lengthen the shorter one"):
        one + Motion.from_arrays(time * (1 + 1e-8), wave * [0.01, 0.0, 0.0])


def test_histories_print_in_one_line():
    """Not their arrays, of which a record has thousands of numbers."""
    assert (
        repr(Motion.from_arrays(TIME, WAVY, name="wavy")) == f"Motion wavy: {TIME[-1]:.6g} s in {len(TIME) - 1} pieces"
    )
    assert repr(Load.constant((1.0, 0.0, 0.0))) == "Load without a name: 1 s in 1 pieces"


def test_sum_adds(every):
    t = np.linspace(0, 6, 99)
    x, y = Motion.from_arrays(TIME, WAVY), Motion.from_acceleration(np.linspace(0, 6, 13), np.ones((13, 3)))
    for d in range(3):
        np.testing.assert_allclose((x + y).evaluate(t, d), x.evaluate(t, d) + y.evaluate(t, d), atol=1e-11)
    with pytest.raises(InputError, match="durations"):
        _ = x + every["harmonic"]


def test_evaluate_takes_any_shape_and_refuses_what_lies_outside(every):
    motion = every["circle"]
    assert motion.evaluate(1.0).shape == (6,)
    assert motion.acceleration(np.ones((2, 5))).shape == (2, 5, 3)
    assert motion.rotation([1.0]).shape == (1, 3)
    assert not motion.evaluate(1.0, 6).any()
    for bad in (-1e-9, motion.duration * (1 + 1e-9), np.nan):
        with pytest.raises(InputError, match=r"outside the motion|time\[1\]: nan is not finite"):
            motion.displacement([0.0, bad])
    with pytest.raises(InputError, match="derivative"):
        motion.evaluate(0.0, -1)


def _pieces(*rows):
    """One-channel pieces of length one from ascending powers."""
    c = np.zeros((len(rows), 6, 6))
    for i, row in enumerate(rows):
        c[i, 0, : len(row)] = row
    return np.arange(len(rows) + 1.0), c


def test_jumps_are_refused_unless_declared_and_only_in_acceleration():
    with pytest.raises(InputError, match=r"position of u_g1 jumps by 1 at t = 1 s"):
        Motion(*_pieces([0, 0], [1, 0]))
    with pytest.raises(InputError, match=r"velocity of u_g1 jumps by -1 at t = 1 s.*impulse"):
        Motion(*_pieces([0, 1], [1, 0]))
    with pytest.raises(InputError, match="velocity"):  # declaring does not help
        Motion(*_pieces([0, 1], [1, 0]), jumps=np.array([1.0]))
    with pytest.raises(InputError, match=r"acceleration of u_g1 jumps by 2 at t = 1 s.*`jumps`"):
        Motion(*_pieces([0, 0], [0, 0, 1]))
    assert Motion(*_pieces([0, 0], [0, 0, 1]), jumps=np.array([1.0])).acceleration(1.0)[0] == 2
    with pytest.raises(InputError, match="not a knot"):
        Motion(*_pieces([0, 0], [0, 0, 1]), jumps=np.array([0.5]))


def test_hermite_reproduces_quintics():
    knots = np.array([0.0, 0.3, 1.0])
    p = np.polynomial.Polynomial([1, -2, 3, -4, 5, -6.0])
    rows = [p.deriv(d)(knots)[:, None] if d else p(knots)[:, None] for d in range(3)]
    c = piecewise.hermite5(knots, *rows)
    t = np.linspace(0, 1, 30)
    np.testing.assert_allclose(piecewise.evaluate(knots, c, t)[:, 0], p(t), atol=1e-13)


def test_motion_that_rests_at_every_knot_may_carry_rounding():
    """Its acceleration is zero at all knots: what rounding leaves there is measured by what it is in between."""
    knots, coefficients = np.array([0.0, 50.0, 125.0]), np.zeros((2, 6, 6))
    for i, (h, d) in enumerate([(50.0, 0.1), (75.0, -0.15)]):
        coefficients[i, 0, 0] = 0.1 * i
        coefficients[i, 0, 3:] = 10 * d / h**3, -15 * d / h**4, 6 * d / h**5
    assert Motion(knots=knots, coefficients=coefficients).displacement(125.0)[0] == pytest.approx(-0.05, rel=1e-9)
    coefficients[0, 0, 2] = 1e-9  # a jump of 2e-9 m/s^2 beside a peak of 2e-4 m/s^2
    with pytest.raises(InputError):
        Motion(knots=knots, coefficients=coefficients)
