"""The equations in SymPy are those of the compiled models: numbers, derivatives, LaTeX, what a reader derives."""

from __future__ import annotations

import re
import runpy
import time
from typing import Any

import numpy as np
import pytest
from support import ROOT, bearing_of, model_of, thinned
from support.random_states import inputs, sensible

from msfp_gen import Effects, InputError, Layout, Top, presets, symbolic
from msfp_gen.cli import main
from msfp_gen.model.symbolic import SECTIONS


def numbers(layout: tuple[int, int, int], seed: int) -> tuple[Any, ...]:
    """A bearing, its state, unknowns and inputs as the compiled model takes them, and the same as flat arrays."""
    values, state, h, load = sensible(layout, seed)
    rng, count = np.random.default_rng(seed), layout[0] - 1
    unknowns = np.concatenate(
        [rng.uniform(-5, 5, 3 * count), rng.uniform(-0.1, 0.1, 2 * count), rng.uniform(8e3, 1.2e4, count)]
    )
    base = state.base
    motion = np.array([[base.displacement, base.angles], [base.velocity, base.rates]])
    motion = np.concatenate([motion, [[base.acceleration, base.rate_rates]]]).reshape(3, 6)
    given = np.concatenate([motion[:, :3].ravel(), motion[:, 3:].ravel(), load.force, load.moment])
    flat = np.concatenate([state.q.ravel(), state.v.ravel(), h.ravel()]), unknowns, given
    return bearing_of(values), state, h, inputs(state, load), motion, flat


def close(found: Any, want: Any) -> bool:
    """To 1e-12 of the largest number."""
    return bool(np.abs(found - want).max() <= 1e-12 * np.abs(want).max())


@pytest.mark.parametrize("met", [False, True], ids=("clear", "at the rims"))
@pytest.mark.parametrize(
    "layout", thinned([((3, 1, 1),), ((5, 2, 2),), ((6, 3, 2),)], lambda layout: layout != (6, 3, 2))
)
def test_equations_in_sympy_are_those_of_the_compiled_model(layout, met):
    count = layout[0] - 1
    begin = time.process_time()
    model = symbolic(Layout(*layout), Effects(bouc_wen="report"))
    residual, jacobian, rates = (x.lambdify() for x in (model.residual, model.jacobian(), model.friction_rates))
    points = [getattr(model, name) for name in ("position", "velocity", "acceleration", "rotation")]
    vectors = [x.lambdify() for x in points]
    by_state, by_inputs = (model.jacobian(wrt).lambdify() for wrt in ("state", "inputs"))
    compiled = model_of(layout)
    for seed in range(3):
        bearing, state, h, given, motion, flat = numbers(layout, seed)
        if met:
            bearing = bearing.replace(capacity=[1e-4] * count)
        at = (*flat, model.values(bearing))
        assert close(residual(*at), compiled.residual(bearing, state.q, state.v, h, flat[1], **given))
        for wrt, function in (("unknowns", jacobian), ("state", by_state), ("inputs", by_inputs)):
            want = compiled.jacobian(bearing, state.q, state.v, h, flat[1], wrt=wrt, **given)
            for rows in (slice(0, 3), slice(3, 6)):  # forces and moments
                kind = np.arange(len(want)).reshape(-1, 6)[:, rows].ravel()
                assert close(function(*at)[kind], want[kind]), wrt
        named = compiled.kinematics(bearing, state.q, state.v, flat[1][: 3 * count].reshape(-1, 3), base=motion)
        for x, function in zip(points, vectors, strict=True):
            assert close(function(*at), np.array([named[name] for name in x.names]))
        found = compiled.evaluate(bearing, state.q, state.v, h, **given)
        at = (at[0], np.concatenate([flat[1][: 3 * count], found.unknowns[3 * count :]]), *at[2:])
        assert np.abs(rates(*at).reshape(-1, 2) - found.friction_rate).max() < 1e-9 * np.abs(found.friction_rate).max()
    assert set(named) - {f"t_{k}" for k in range(1, layout[0] + 1)} == {name for x in points for name in x.names}
    assert time.process_time() - begin < 5 or layout[0] > 5


OTHERS = [{"sliders": "massless"}, {"spin": "patch"}, {"friction": "velocity"}]


@pytest.mark.parametrize("effects", thinned([{}, *OTHERS], lambda effects: not effects), ids=str)
@pytest.mark.parametrize("dimension", ["planar", "spatial"])
def test_effects_are_those_of_the_compiled_model(dimension, effects):
    if dimension == "planar" and "spin" in effects:
        pytest.skip("bodies of a plane do not spin")
    bearing, state, h, given, _, flat = numbers((3, 1, 1), 0)
    if "friction" in effects:
        bearing = bearing.replace(friction_slow=0.02, velocity_rate=20.0)
    model = symbolic(Layout.dfp(), Effects(bouc_wen="report", dimension=dimension, **effects))
    compiled = model_of((3, 1, 1), dimension=dimension, **effects)
    if dimension == "planar":
        plane = np.array([0.0, 1.0, 0.0])
        q, v, h = state.q * plane, state.v * plane, h * [1.0, 0.0]
        up = np.array([1.0, 0.0, 1.0])
        given = {
            "base_acceleration": given["base_acceleration"] * up,
            "top_force": given["top_force"] * up,
            "top_moment": given["top_moment"] * plane,
            "base_rotation": [x * plane for x in given["base_rotation"]],
        }
        unknowns = flat[1][[1, 4, 7, 9, 10, 11]]
        base = [np.zeros(4), given["base_acceleration"][::2], [x[1] for x in given["base_rotation"]]]
        flat = (
            np.concatenate([q[:, 1], v[:, 1], h[:, 0]]),
            unknowns,
            np.concatenate([*base, given["top_force"][::2], given["top_moment"][1:2]]),
        )
        state = type(state)(q, v, state.a, state.base)
    at = (*flat, model.values(bearing))
    args = (bearing, state.q, state.v, h, flat[1])
    assert close(model.residual.lambdify()(*at), compiled.residual(*args, **given))
    assert close(model.jacobian().lambdify()(*at), compiled.jacobian(*args, **given))


def test_numbers_of_a_bearing_and_a_top_take_the_place_of_symbols():
    bearing, _, _, _, _, flat = numbers((3, 1, 1), 1)
    model, top = symbolic(Layout.dfp()), Top.mass(3e3, 2e3, 0.3, rotational_stiffness=1e7)
    numeric = model.subs(bearing, top)
    assert numeric.parameters == () and {s.name for s in numeric.residual["E1_2"].values.free_symbols}
    want = model.residual.lambdify()(*flat, model.values(bearing, top))
    found = numeric.residual.lambdify()(*flat)
    assert np.abs(found - want).max() < 1e-9 * np.abs(want).max()
    assert np.abs(want - model.residual.lambdify()(*flat, model.values(bearing))).max() > 1e3
    expanded = numeric.residual.expanded()
    assert expanded.free_symbols <= {*model.state, *model.unknowns, *model.inputs}
    at = dict(zip((*model.state, *model.unknowns, *model.inputs), np.concatenate(flat), strict=True))
    values = numeric.residual.subs(at).expanded()
    assert np.abs(np.array(values, dtype=float).ravel() - want).max() < 1e-9 * np.abs(want).max()


def test_many_states_at_once():
    bearing, _, _, _, _, flat = numbers((3, 1, 1), 1)
    model = symbolic(Layout.dfp())
    function, values = model.jacobian("state").lambdify(), model.values(bearing)
    states = flat[0] * np.linspace(0.5, 1.0, 7)[:, None]
    many = function(states, flat[1], flat[2], values)
    assert many.shape == (7, 12, 16)
    assert np.abs(many - [function(state, *flat[1:], values) for state in states]).max() < 1e-12 * np.abs(many).max()
    with pytest.raises(ValueError, match="its last axis has 16 numbers"):
        function(flat[0][:-1], *flat[1:], values)
    with pytest.raises(TypeError, match="give 4 arrays: state, unknowns, inputs, parameters"):
        function(flat[0])


def test_rims_far_away_are_defined_at_zero_tilt():
    """Their direction (3.24) is 0/0 there; neither values nor derivatives may be."""
    model = symbolic(Layout.dfp())
    bearing = presets.bearing("double-fp")
    for expressions in (model.residual, model.jacobian(), model.jacobian("state")):
        at = np.zeros(len(model.state)), np.zeros(len(model.unknowns)), np.zeros(len(model.inputs))
        assert np.isfinite(expressions.lambdify()(*at, model.values(bearing))).all()


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ({"uplift": True}, "effects.uplift"),
        ({"top_rotation": True}, "effects.top_rotation"),
        ({"friction": "pvt"}, "effects.friction"),
    ],
)
def test_effects_without_symbols_are_refused(effects, words):
    with pytest.raises(InputError, match=words):
        symbolic(Layout.dfp(), Effects(**effects))


def test_what_does_not_belong_is_refused():
    model = symbolic(Layout.dfp())
    with pytest.raises(InputError, match="of 3_1_1"):
        model.values(presets.bearing("fenz-tfp"))
    with pytest.raises(InputError, match="vertical_stiffness"):
        model.values(presets.bearing("double-fp"), Top.rig(1e5, 1e8, vertical_stiffness=1e8))
    with pytest.raises(InputError, match="wrt = 'time'"):
        model.jacobian("time")
    with pytest.raises(KeyError, match="r_99"):
        model.position["r_99"]
    with pytest.raises(ValueError, match="of a column alone"):
        model.position.jacobian(model.state)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("layout", "planar"),
    [(Layout.dfp(), True), (Layout.tfp(), True), (Layout.tfp(), False)],
)
def test_latex_parses_as_mathematics(layout, planar):
    from matplotlib.mathtext import MathTextParser

    model, parser = symbolic(layout, Effects(dimension="planar" if planar else "spatial")), MathTextParser("path")
    rows = [row for name in SECTIONS for row in getattr(model, name).latex_rows()]
    assert len(rows) > 25 * layout.surfaces and {r"t_{3x}^{3}", r"\dot{r}_{1c}", r"\eta_{2,2}"} <= {
        left for left, _ in rows
    }
    for left, right in rows:
        parser.parse(f"${left}$")
        parser.parse(f"${right}$")
    assert model.residual.latex().startswith("\\begin{aligned}\n")


def test_command_prints_statements_before_they_are_used(capsys):
    assert main(["equations", "2", "1", "0", "--planar", "--no-rims"]) == 0
    text = capsys.readouterr().out
    head, _, body = text.partition("# position")
    names = set(re.findall(r"\w+", re.sub(r"^#.*$", "", head, flags=re.MULTILINE)))
    for line in body.splitlines()[1:]:
        if " = " in line:
            left, right = line.split(" = ")
            used = set(re.findall(r"[A-Za-z_]\w*", right)) - {"sin", "cos", "sqrt", "Step"}
            assert used <= names, line
            names.add(left)
    assert {"E1_2", "E3_2", "t2_2", "dY_1", "r_12"} <= names


def test_command_writes_a_document(capsys):
    assert main(["equations", "3", "1", "1", "--latex", "--planar"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(r"\documentclass") and text.rstrip().endswith(r"\end{document}")
    assert text.count(r"\begin{align*}") == text.count(r"\end{align*}") == len(SECTIONS)
    assert main(["equations", "3", "1", "2"]) == 2


def small_oscillations(bearing, top):
    """Mass, stiffness of weights and of stuck friction of a stack at small tilts, by Lagrange, in plain numpy.

    Body k tilts by Q_k against the vertical about the sphere centre below it, c_k from its centre of mass, and carries
    the next one D_k higher. Written without the equations of the package.
    """
    n = bearing.layout.n
    signs = [1] * bearing.layout.m + [-1] * bearing.layout.p + [0]
    radii = [s.radius for s in bearing.surfaces] + [0.0]
    g, lower = bearing.gravity, np.tril(np.ones((n - 1, n - 1)), -1)
    parts = list(zip(bearing.bodies, signs[:-1], signs[1:], radii[:-1], radii[1:], strict=True))
    # From the bottom of the body: the sphere centre below is R up where the surface is concave up, down otherwise.
    D = np.array([body.height - below * R + above * S for body, below, above, R, S in parts])
    c = np.array([(b.centroid if below > 0 else b.height - b.centroid) - below * R for b, below, _, R, _ in parts])
    m, J = np.array([b.mass for b in bearing.bodies]), np.array([b.inertia[0] for b in bearing.bodies])
    move = lower * D + np.diag(c)  # of the centres of mass, by tilts
    mass = move.T @ np.diag(m) @ move + np.diag(J)
    at_top = np.append(D[:-1], D[-1] + top.height)
    mass += top.mass * np.outer(at_top, at_top)
    mass[-1, -1] += top.inertia[0]
    carried = np.cumsum(np.append(m[1:], top.mass)[::-1])[::-1]
    weights = -g * np.diag(m * c + carried * D)
    weights[-1, -1] += top.rotational_stiffness - top.mass * g * top.height
    turn = np.eye(n - 1) - np.eye(n - 1, k=-1)
    normal = g * (carried + m)
    spring = [
        s.friction * N * s.radius**2 / s.yield_displacement for s, N in zip(bearing.surfaces, normal, strict=True)
    ]
    return mass, weights, turn.T @ np.diag(spring) @ turn


@pytest.mark.slow
def test_example_derives_stiffness_and_frequencies(capsys):
    import matplotlib as mpl

    mpl.use("agg")
    found = runpy.run_path(str(ROOT / "examples" / "gallery" / "equations" / "stiffness.py"))
    text = capsys.readouterr().out
    want = small_oscillations(found["bearing"], found["top"])
    for one, other in zip(("mass", "hanging", "friction"), want, strict=True):
        assert np.abs(found[one] - other).max() < 1e-10 * np.abs(other).max(), one
    squares = np.linalg.eigvals(np.linalg.solve(want[0], want[1] + want[2]))
    assert found["found"] == pytest.approx(np.sqrt(np.sort(squares.real)) / (2 * np.pi), rel=1e-8)
    assert found["K"].is_diagonal() and found["M"].is_symmetric() and found["stuck"].is_symmetric()
    free = np.sqrt(found["bearing"].gravity / found["length"]) / (2 * np.pi)
    assert found["free"][0] == pytest.approx(free, rel=2e-3)  # sliders and their inertia
    assert "pendulum [Hz]: 0.534" in text


def test_page_runs(capsys):
    page = (ROOT / "docs" / "own_integrator.md").read_text(encoding="utf-8").split("\n## The equations in SymPy\n")[1]
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    space: dict[str, Any] = {}
    for block in blocks:
        exec(block, space)
    said = capsys.readouterr().out
    assert len(blocks) == 2 and "Matrix([[-N_1 + N_2 + g*m_2]])" in said and "t2_2 = " in said
