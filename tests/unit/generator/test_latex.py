"""The equations shown to people are those that run: docs/equations.md and the assembled small stack."""

import importlib.util
import re

import numpy as np
import pytest
import sympy as sp
from support import ROOT

from msfp_gen import Bearing, Body, Effects, Layout, Surface, build_model
from msfp_gen.generator.derive import derive
from msfp_gen.generator.functions import Step
from msfp_gen.generator.latex import PLACES, statements
from msfp_gen.specification.layout import ModelSpec


def page_script():
    spec = importlib.util.spec_from_file_location("make_equations", ROOT / "docs" / "make_equations.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def planar():
    return build_model(Layout(2, 1, 0), Effects(dimension="planar", bouc_wen="report"))


def random_numbers(rng, level):
    """A number for every symbol of the assembled stack; the rim stays open."""
    lengths = {"R_1": 0.5, "ell_1": 0.02, "ell_2": 0.04, "z_2": 0.015, "d_1": 2e-4}
    sizes = lengths | {"m_2": 4.0, "lambda_2": 0.03, "g": 9.8, "mu_1": 0.1}
    numbers = {name: value * rng.uniform(0.5, 1.5) for name, value in sizes.items()}
    motions = ("ddu_g1", "ddu_g3", "dtheta_1", "ddtheta_1", "dtheta_2", "ddtheta_2")
    numbers |= {name: rng.uniform(-1.0, 1.0) for name in (*motions, "thetat_1", "Y_1")}
    numbers |= {name: rng.uniform(-0.3, 0.3) for name in ("theta_1", "theta_2")}  # steeper, the load would pull
    numbers |= {"N_1": rng.uniform(8e3, 1.2e4), "F_1": rng.uniform(-1e3, 1e3), "F_3": -1e4, "M_2": rng.uniform(-50, 50)}
    return numbers | dict.fromkeys(("theta_1", "dtheta_1", "ddtheta_1"), 0.0) if level else numbers


def compiled(model, x):
    """E1, E3, t2 and dY/dt of the emitted C at the numbers `x`."""
    bearing = Bearing(
        layout=Layout(2, 1, 0),
        base_height=x["ell_1"],
        gravity=x["g"],
        surfaces=[Surface(x["R_1"], 1.3 * x["R_1"], x["mu_1"], x["d_1"], 1e7, 0.0, contact_damping=0.0)],
        bodies=[Body(x["ell_2"], x["z_2"], x["m_2"], (x["lambda_2"], x["lambda_2"]))],
    )
    state = [[[0.0, x[f"{dots}theta_2"], 0.0]] for dots in ("", "d")]
    given = {
        "base_acceleration": (x["ddu_g1"], 0.0, x["ddu_g3"]),
        "top_force": (x["F_1"], 0.0, x["F_3"]),
        "top_moment": (0.0, x["M_2"], 0.0),
        "base_rotation": [(0.0, x[f"{dots}theta_1"], 0.0) for dots in ("", "d", "dd")],
    }
    h = [[x["Y_1"], 0.0]]
    unknowns = [x["ddtheta_2"], x["thetat_1"], x["N_1"]]
    rates = model.evaluate(bearing, *state, h, **given).friction_rate
    return np.append(model.residual(bearing, *state, h, unknowns, **given), rates[0, 0])


def number(expression, x):
    """The value of an assembled expression."""
    at = expression.xreplace({sp.Symbol(name, real=True): sp.Float(value) for name, value in x.items()})
    return float(at.replace(Step, lambda argument: sp.Integer(1 if argument > 0 else 0)))


@pytest.mark.parametrize("level", [False, True])
def test_assembled_stack_is_what_runs(planar, level):
    """The scalar equations of docs/equations.md against the compiled model: also after they were made readable."""
    rng = np.random.default_rng(5)
    script = page_script()
    assembled, _ = script.assembled()
    shown = {name: script.readable(script.over_level_base(e) if level else e) for name, e in assembled.items()}
    for form in (shown, assembled):
        for _ in range(20):
            x = random_numbers(rng, level)
            want = compiled(planar, x)
            found = [number(e, x) for e in form.values()]
            assert found == pytest.approx(want, rel=1e-9, abs=1e-8)


def test_assembled_equations_hold_nothing_but_known_symbols():
    known = set(random_numbers(np.random.default_rng(0), level=False))
    script = page_script()
    assert {s.name for e in script.assembled()[0].values() for s in e.free_symbols} <= known
    assert list(script.assembled_latex()) == ["E1", "E3", "t2", "dY"]


def left_sides(page):
    """What each statement of the page defines, in order."""
    return re.findall(r"^(.+?) &= ", page, flags=re.MULTILINE)


def test_committed_page_is_that_of_the_programs():
    """By titles and left sides: SymPy may order the terms of a sum differently from version to version."""
    committed, fresh = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8"), page_script().text()
    assert left_sides(committed) == left_sides(fresh), "the programs changed: run `python docs/make_equations.py`"
    titles = re.compile("^#.*$", flags=re.MULTILINE)
    assert titles.findall(committed) == titles.findall(fresh)


def test_script_replaces_the_page(tmp_path, monkeypatch):
    script = page_script()
    monkeypatch.setattr(script, "TARGET", tmp_path / "equations.md")
    script.main()
    assert [p.name for p in tmp_path.iterdir()] == ["equations.md"]
    assert (tmp_path / "equations.md").read_text(encoding="utf-8") == script.text()


@pytest.mark.slow
def test_every_statement_parses_as_mathematics():
    from matplotlib.mathtext import MathTextParser

    page = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\\begin\{aligned\}\n(.*?)\n\\end\{aligned\}$", page, flags=re.MULTILINE | re.DOTALL)
    assert len(rows) > 30
    parser = MathTextParser("path")
    for row in "\n".join(rows).splitlines():
        for side in row.removesuffix(r"\\").split("&"):
            if side.strip():
                parser.parse(f"${side.strip()}$")


def test_every_program_that_carries_the_motion_is_shown():
    planar = Effects(dimension="planar", sliders="massless", bouc_wen="report")
    two_port = Effects(top_rotation=True, bouc_wen="report")  # of which only what the others lack is shown
    shown = (two_port, planar, Effects(bouc_wen="report"))
    hidden = {"named_points", "body_energy", "top_energy"}  # the same again, or bookkeeping
    hidden |= {"rim_coordinates", "balances", "surface_moment", "rim_motion", "works"}  # gather or add only
    hidden |= {"report_rates", "surface_results", "tilt", "load_end"}  # likewise
    hidden |= {"extreme_length", "bounded_friction", "rim_bound"}  # of rows; a bound of a gap that is shown
    hidden |= {"surface_block", "top_block"}  # values of the scene under other names
    hidden |= {"twist", "transported_twist", "transported_force", "transported_wrench", "turning_balance"}
    hidden |= {"variation_of_rates", "local_variation", "force_to_local"}
    hidden |= {"upright"}  # the axis of a support that rotates
    names = {p.name: p for effects in shown for p in derive(ModelSpec(Layout.tfp(), effects)).programs}
    assert set(names) - hidden == set(PLACES)
    for name in PLACES:
        rows = statements(names[name])
        assert len({left for left, _ in rows}) == len(rows), f"{name} writes one symbol twice"


@pytest.mark.parametrize("page", ["README.md", "docs/model.md", "docs/architecture.md", "docs/extending.md"])
def test_mathematics_of_the_pages_parses(page):
    from matplotlib.mathtext import MathTextParser

    text = re.sub(r"^```.*?^```$", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    shown = re.findall(r"^\$\$\n(.*?)\n\$\$$", text, flags=re.MULTILINE | re.DOTALL)
    inline = re.sub(r"^\$\$\n(.*?)\n\$\$$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert inline.count("$") % 2 == 0, "a dollar sign stands alone"
    for formula in (*shown, *re.findall(r"\$([^$]+)\$", inline)):
        MathTextParser("path").parse(f"${' '.join(formula.split())}$")
