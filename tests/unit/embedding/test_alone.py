"""The derived equations alone (`generate --equations`): numbers, Jacobians, what is in the folder, what is refused."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import bearing_of, differences, thinned
from support.random_states import sensible

from msfp_gen import Effects, InputError, Layout, symbolic
from msfp_gen.cli import main
from msfp_gen.embedding.alone import write_alone
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
from msfp_gen.specification.layout import ModelSpec

CASES = {
    "double": (Layout.dfp(), Effects(bouc_wen="report")),
    "planar triple": (Layout.tfp(), Effects(bouc_wen="report", dimension="planar")),
    "spinning": (Layout(3, 2, 0), Effects(bouc_wen="isotropic", spin="free", rims=False)),
    "massless": (Layout(2, 0, 1), Effects(sliders="massless")),
}


@pytest.fixture(scope="module", params=thinned(CASES, lambda name: name == "double"))
def built(request, tmp_path_factory) -> tuple[Any, ModelSpec, Path]:
    """The module of a case, its model and its folder."""
    spec = ModelSpec(*CASES[request.param])
    info = write_alone(spec, tmp_path_factory.mktemp("alone") / "equations")
    found = importlib.util.spec_from_file_location(info.module, info.path)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    sys.modules.pop(info.module, None)  # another model of this layout has the same name
    return module, spec, info.folder


def case(spec: ModelSpec, seed: int, met: bool = False) -> tuple[Any, dict[str, Any]]:
    """A bearing, and a state with inputs as the module takes them; in the plane where the model is planar."""
    values, state, h, load = sensible((spec.layout.n, spec.layout.m, spec.layout.p), seed)
    base, count = state.base, spec.layout.surfaces
    motion = np.array(
        [
            np.r_[base.displacement, base.angles],
            np.r_[base.velocity, base.rates],
            np.r_[base.acceleration, base.rate_rates],
        ]
    )
    given = {"q": state.q, "v": state.v, "h": h, "base": motion, "load": np.r_[load.force, load.moment]}
    if spec.effects.dimension == "planar":
        axial, polar = [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]
        keep = {"q": axial, "v": axial, "h": [1.0, 0.0], "base": [*polar, *axial], "load": [*polar, *axial]}
        given = {name: value * keep[name] for name, value in given.items()}
    bearing = bearing_of(values).replace(contact_damping=0.0)
    return (bearing.replace(capacity=[1e-4] * count) if met else bearing), given


def equations_of(module: Any, spec: ModelSpec, bearing: Any) -> Any:
    return module.Equations(bearing.gravity, *bodies_and_surfaces(bearing, spec.effects), top_values(None))


def flat(model: Any, given: dict[str, Any], unknowns: Any) -> tuple[Any, ...]:
    """The same as `symbolic` takes it."""
    planar = model.spec.effects.dimension == "planar"
    angles, pairs, axes = ([1], [0], [0, 2]) if planar else ([0, 1, 2], [0, 1], [0, 1, 2])
    state = [given["q"][:, angles], given["v"][:, angles], given["h"][:, pairs]]
    inputs = [given["base"][:, axes], given["base"][:, 3:][:, angles], given["load"][axes], given["load"][3:][angles]]
    return (
        *(np.concatenate([x.ravel() for x in group]) for group in (state,)),
        unknowns,
        np.concatenate([x.ravel() for x in inputs]),
    )


@pytest.mark.parametrize("met", [False, True], ids=("clear", "at the rims"))
def test_balances_and_points_are_those_of_the_symbols(built, met):
    module, spec, _ = built
    model = symbolic(spec.layout, spec.effects)
    rng = np.random.default_rng(3)
    bearing, given = case(spec, 2, met)
    unknowns = rng.uniform(-0.1, 0.1, len(module.UNKNOWNS))
    unknowns[-module.NB :] = rng.uniform(8e3, 1.2e4, module.NB)
    at = (*flat(model, given, unknowns), model.values(bearing))
    equations = equations_of(module, spec, bearing)
    residual, rates, jacobian = equations.balances(unknowns=unknowns, **given, jacobian=True)
    want = model.residual.lambdify()(*at)
    assert np.abs(residual - want).max() < 1e-12 * np.abs(want).max()
    want = model.friction_rates.lambdify()(*at)
    assert np.abs(rates - want).max() < 1e-12 * np.abs(want).max()
    want = model.jacobian().lambdify()(*at)
    assert np.abs(jacobian[: len(residual), module.UNKNOWNS] - want).max() < 1e-12 * np.abs(want).max()
    a = np.zeros((module.NB, 3))
    a[:, [1] if spec.effects.dimension == "planar" else [0, 1, 2]] = (
        unknowns[: -3 * module.NB].reshape(module.NB, -1)
        if spec.effects.dimension == "spatial"
        else unknowns[: module.NB, None]
    )
    points, rotations = equations.kinematics(given["q"], given["v"], a, given["base"])
    order, found = ("lo", "cm", "up", "sc"), {}
    from msfp_gen.specification.layout import point_names

    for body, point, name in point_names(spec.layout.n):
        found |= {f"{letter}_{name}": points[body, order.index(point), i] for i, letter in enumerate("rva")}
    for i, name in enumerate(("omega", "omega'", "alpha", "alpha'")):
        found |= {f"{name}_{k + 1}": rotations[k, i] for k in range(spec.layout.n)}
    for expressions in (model.position, model.velocity, model.acceleration, model.rotation):
        want = expressions.lambdify()(*at)
        assert np.abs(np.array([found[name] for name in expressions.names]) - want).max() < 1e-12 * (
            1 + np.abs(want).max()
        )


def test_condensed_form_has_the_accelerations_of_the_balances(built):
    """Newton's method on either form, and the normal forces that follow."""
    module, spec, _ = built
    if spec.effects.sliders == "massless":
        pytest.skip("massless sliders have no accelerations")
    bearing, given = case(spec, 4)
    equations = equations_of(module, spec, bearing)
    free = [1] if spec.effects.dimension == "planar" else [0, 1] if spec.effects.spin == "locked" else [0, 1, 2]
    start = module.FIELDS["a"][0]
    columns = [start + 3 * k + i for k in range(module.NB) for i in free]
    a = np.zeros((module.NB, 3))
    for _ in range(20):
        left, rates, normal, jacobian = equations.condensed(a=a, **given, jacobian=True)
        a[:, free] -= np.linalg.solve(jacobian[: module.DOF, columns], left).reshape(module.NB, -1)
    unknowns = np.zeros(len(module.UNKNOWNS))
    unknowns[-module.NB :] = normal
    for _ in range(30):
        residual, found, jacobian = equations.balances(unknowns=unknowns, **given, jacobian=True)
        unknowns -= np.linalg.solve(jacobian[: len(residual), module.UNKNOWNS], residual)
    assert np.abs(unknowns[-module.NB :] - normal).max() < 1e-9 * normal.max()
    assert np.abs(found - rates).max() < 1e-8 * np.abs(rates).max()
    per_body = unknowns[: -3 * module.NB if spec.effects.dimension == "spatial" else module.NB].reshape(module.NB, -1)
    want = per_body if spec.effects.dimension == "planar" else per_body[:, free]
    assert np.abs(a[:, free] - want).max() < 1e-9 * (1 + np.abs(want).max())


def test_jacobians_are_the_differences_of_what_they_differentiate(built):
    module, spec, _ = built
    bearing, given = case(spec, 6)
    equations = equations_of(module, spec, bearing)
    given |= {"a": np.random.default_rng(0).uniform(-2, 2, (module.NB, 3)), "g": 0.9 * given["h"]}
    if spec.effects.dimension == "planar":
        given["a"] *= [0.0, 1.0, 0.0]
    *_, jacobian = equations.condensed(**given, jacobian=True)
    for name, value in given.items():
        first, shape = module.FIELDS[name]

        def moved(x, name=name, shape=shape):
            return np.concatenate(equations.condensed(**(given | {name: x.reshape(shape)})))

        steps = np.full(value.size, 10.0 if name == "load" else 1e-3)
        want = differences(moved, value.ravel(), steps)
        found = jacobian[:, first : first + value.size]
        scale = np.abs(jacobian).max(axis=1, keepdims=True)
        assert np.abs((found - want) / scale).max() < 1e-7, name


def test_many_states_at_once_and_wrong_shapes(built):
    module, spec, _ = built
    bearing, given = case(spec, 1)
    equations, scale = equations_of(module, spec, bearing), np.linspace(0.5, 1.0, 5)
    q = given["q"] * scale[:, None, None]
    given["a"] = np.zeros((module.NB, 3))
    many = equations.condensed(**(given | {"q": q}))
    for i, one in enumerate(q):
        for found, want in zip(many, equations.condensed(**(given | {"q": one})), strict=True):
            assert np.array_equal(found[i], want)
    with pytest.raises(ValueError, match=rf"q has shape \({module.NB}, 2\)"):
        equations.condensed(**(given | {"q": given["q"][:, :2]}))
    with pytest.raises(ValueError, match="no vertical spring"):
        module.Equations(9.8, *bodies_and_surfaces(bearing, spec.effects), np.ones(len(module.TOP_VALUES)))


def test_folder_is_small_and_its_example_runs_with_numpy_alone(built):
    module, spec, folder = built
    names = sorted(path.name for path in folder.iterdir())
    assert len(names) <= 10, names
    wrapper = (folder / f"{module.__name__}.pyx").read_text(encoding="utf-8")
    assert wrapper.count("\n") <= 200
    assert "warning" not in (folder / "build.log").read_text(encoding="utf-8")
    code = re.search(r"^```python\n(.*?)^```", (folder / "README.md").read_text(encoding="utf-8"), re.M | re.S)[1]
    loaded = "import sys; print('msfp_gen' in sys.modules, 'sympy' in sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", f"{code}\n{loaded}"], cwd=folder, capture_output=True, text=True, check=True
    )
    residual = float(re.search(r"residual \[N m\]: (\S+)", run.stdout)[1])
    assert np.isfinite(residual) and (residual < 1e-6 or spec.effects.sliders == "massless")
    assert run.stdout.splitlines()[-1] == "False False"


@pytest.mark.parametrize(
    ("effects", "word"),
    [({"uplift": True}, "uplift"), ({"top_rotation": True}, "top_rotation"), ({"friction": "pvt"}, "friction")],
)
def test_effects_that_need_the_runtime_are_refused(effects, word, tmp_path):
    with pytest.raises(InputError, match=f"effects.{word}"):
        write_alone(ModelSpec(Layout.dfp(), Effects(**effects)), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_command_refuses_what_it_cannot_write(tmp_path, capsys):
    assert main(["generate", "3", "1", "1", "--equations"]) == 2
    assert "-o DIR" in capsys.readouterr().err
    (tmp_path / "mine.txt").write_text("of the user")
    assert main(["generate", "3", "1", "1", "--equations", "-o", str(tmp_path)]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
