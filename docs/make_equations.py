"""Write docs/equations.md from the programs that become C: `python docs/make_equations.py`."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import sympy as sp
from sympy.simplify.fu import TR8

from msfp_gen import symbolic
from msfp_gen.common.output import replacing
from msfp_gen.common.tables import markdown_table
from msfp_gen.generator import body, contact, energy, laws, parameters, top, two_port
from msfp_gen.generator.derive import derive
from msfp_gen.generator.latex import statements, to_latex
from msfp_gen.generator.places import If, Over, Pass, passes_of
from msfp_gen.generator.schedule import condensed, momentum_balances
from msfp_gen.generator.schedule import two_port as ends
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import docs_folder, parser

TARGET = docs_folder() / "equations.md"
MODULES = (body, contact, energy, laws, parameters, top, two_port)
ROWS = 6  # statements in one block; long blocks do not render everywhere

INTRODUCTION = r"""# The equations, as the generator writes them

For readers who want the equations in full. `docs/make_equations.py` writes this page from the same programs that become
C; do not edit it. Equation numbers follow PEER Report 2017/07 ("PEER 2017/07"); [model.md](model.md) explains what is
computed and why, and [glossary.md](glossary.md) the terms.

## A small stack, assembled

The planar stack $(n, m, p) = (2, 1, 0)$ is one slider in one dish, over a base that translates by $u_{g1}, u_{g3}$. The
rim is not in contact. The force $F_1, F_3$ and the moment $M_2$ act on the top plate at $r_{22}$. $\lambda_{1}^{2}$ is
the transverse moment of inertia of body 2 (2.118), $d_1$ the yield displacement ($R_0/R_1$ of PEER 2017/07), and $H(x)$
is 1 for $x > 0$ and 0 otherwise. The unknowns are $\ddot\theta_2$, $\tilde\theta_1$ and $N_1$ (2.119)."""

ASSEMBLED = {
    "E1": ("Linear momentum along $E_1$ (3.28):", " = 0"),
    "E3": ("Linear momentum along $E_3$ (3.28):", " = 0"),
    "t2": ("Angular momentum about the centre of mass, along $t_2$ (3.29):", " = 0"),
    "dY": ("Friction (3.18):", r" = \dot{Y}_1"),
}

PROGRAMS = r"""## One body and one surface, spatial

These are the statements of one body $k$ (between surfaces $k-1$ and $k$) and of one surface $\gamma$ (between bodies
$\gamma$ and $\gamma+1$), in the order of execution. The C code loops over bodies and surfaces, so they apply to every
stack.

- $\sigma = +1$ where a surface is concave up, $-1$ where it is concave down; the radii below the base and above the top
  plate are 0.
- Subscripts $x, y, z$ are components along $E_1, E_2, E_3$; 1, 2, 3 are components along the basis of the body below
  the surface (of the body itself in the angular balance).
- $r_{k}^{c}$ is the sphere centre above body $k$, $r_{kc}$ of (3.4) and (3.8), and $r_{nn}$ for the top plate.
- $P_k, M_k$ is the wrench of interface $k$ on the body above, the moment about the sphere centre; $P_n, M_n$ is
  $-F_{top}, -M_{top}$. $F_E, M_E$ is the prescribed part of $F_{top}, M_{top}$.
- $r_{s\gamma}, p_{s\gamma}$ are rim radius and rim offset of the slider of surface $\gamma$.
- $S_{\psi_k}, C_{\psi_k}, S_{\theta_k}, C_{\theta_k}$ are sines and cosines of the angles of body $k$.
- $E$ are energies [J], $D$ powers that are dissipated and $\dot{W}$ powers of the input [W]; the powers of friction are
  $\dot{E}_f$, stored, $D_c$, dissipated by contact damping, $D_d$ by the drilling moment, and $D_f$ by the rest.
- $c_n(s)$ are the Stumpff functions, $c_1(x^2) = \sin x/x$ and $c_2(x^2) = (1 - \cos x)/x^2$.
- $\operatorname{if}(x, a, b)$ is $a$ for $x > 0$ and $b$ otherwise; $\operatorname{decay}(x)$ is $e^{-x}$ for $x > 0$
  and 1 otherwise.
- Friction over a slip is of planar models without masses. In a step of such a model the body above turns by
  $\alpha + \beta\,\Delta\omega'$, $Y^0$ and $Y^1$ are $Y$ at its ends and $\bar{N}$ is the mean normal force. $W_f$ is
  the work [J] that friction stores and $W_d$ the work that it dissipates. $W_E$ is the work of the load, by its values
  and by displacement $u$ and tilt $\vartheta$ of the top plate at both ends of the step.
- $\eta_V$ is 1 without uplift; with it it is the compliance of the vertical spring and of the unilateral contacts
  over the compliance of the spring.
- $x_1, x_2, \dots$ are local intermediate values of a program."""

SCHEDULE = r"""## One evaluation of a stack

From `generator/schedule.py`: which program runs over which bodies and surfaces, and from which blocks to which. From
the same lines the C is emitted that evaluates a stack, that differentiates it by the variables of a step, and that
differentiates it by parameters, program by program. Bodies are numbered 1 to n as in PEER 2017/07, and surface
$\gamma$ lies between bodies $\gamma$ and $\gamma+1$. Given are the coordinates `x`, the inertial `frame` with the
translation of the base, `load_force` and `load_moment` on the top plate and, where a mass rests on a vertical spring,
its `foot_stage`. The programs follow below, but for those that only gather, add or copy: `rim_coordinates`,
`surface_moment`, `balances`, `report_rates`, `surface_results`, and with uplift `surface_force`, `split_moment`,
`wrench_above`, `excess_force`, `contact_excess`."""

CONDENSED = """### The condensed equations

What a run solves: interface forces are summed from the top plate down, contacts are in closed form, and the angular
balances are left. `contact` is evaluated for all surfaces at once, since C solves for the friction of the end of the
stage (`friction_stage`, `friction_force`)."""

UPLIFT = """With uplift (`docs/uplift.md`) the unilateral contacts and the rims give the forces of the surfaces, and
what these leave of the sums are further rows, `excess`. Forces and moments are then"""

BALANCES = r"""### The momentum balances

The balances (3.26)-(3.29) at given unknowns (2.119), as PEER 2017/07 states them, with the state of `friction` and the
`unknowns` of the contacts. With locked spin $\ddot\phi_k = 0$ takes the place of the axial balance of a body. With
uplift the unilateral contacts give the forces, as above, and further rows (`contact_excess`) state that the forces
(3.15)-(3.17) of the `unknowns` are the same."""

TWO_PORT = r"""### The ends of a two-port

Where another program moves both ends ([embedding.md](embedding.md#two-moving-ends-the-two-port)): the motion of the
upper end, `far_end`, and its rotation, `support`, give the load and the axis on which `top_wrench` depends; the lower
end is `frame` and `x[1]`. After an evaluation follow the wrenches of the ends. `held` sums the moments that lock the
spin. The programs of the condensed equations and these are differentiated by the motion of the ends too, stage by
stage."""

OVER = {
    Over.BASE: "base",
    Over.BODIES: "bodies $k = 2, \\dots, n$",
    Over.SURFACES: "surfaces $\\gamma = 1, \\dots, n-1$",
    Over.DOWNWARD: "surfaces $\\gamma = n-1, \\dots, 1$",
    Over.TOGETHER: "all surfaces at once",
    Over.TOP: "top plate",
}
PLACES = {"j": "γ", "j+1": "γ+1", "base": "1", "top": "n", "slider": "slider"}

TITLES = {
    "body_block": "Distances along the axis, from (3.2)-(3.11)",
    "forward": "Kinematics of a body from the body below: (2.1)-(2.6), (3.4)-(3.12), and rates with (2.36)",
    "contact_angles": "Angles of the normal's position (2.85)",
    "gap": "Sliding and gap (3.20), (3.21)",
    "gap_at": "The same from angles alone (3.20), (3.21)",
    "rim": "Rim contact (3.20)-(3.25), applied only while it pushes",
    "spring_stage": "The spring below a supported mass: constants of its stage formula",
    "resting_foot": "The foot of a supported mass at rest",
    "foot": "The foot of a supported mass on a vertical spring, at the end of a stage",
    "top_wrench": "The top (3.28), (3.29): rig springs, supported mass and outside load",
    "interface_force": "Force through the interface below: (3.26), (3.28) summed from the top",
    "surface_local": "Contact force and slip rotation in the basis of the body below (3.12), (3.19)",
    "slip_rotation": "Slip rotation alone (3.12), (3.19)",
    "contact_stage": "The stage formula of friction, with the damping time of the contact",
    "contact": "Normal force and its position in closed form, friction (3.13)-(3.19)",
    "report_contact": "The same at given unknowns, as stated in PEER 2017/07 (3.13)-(3.19)",
    "report_wrench": "Force and moment of a surface on the body above, contact and rim",
    "moment_to_world": "Moment about the sphere centre",
    "linear_balance": "Balance of linear momentum (3.26), (3.28): left side less right side",
    "angular_balance": "Balance of angular momentum (3.27), (3.29): left side less right side",
    "friction_power": "Powers of friction: stored, dissipated by contact damping, dissipated by plastic slip",
    "rim_energy": "Energy of a closed rim, and power that its damper dissipates",
    "restraint": "Energy of the springs of the top, and the compression of the vertical one",
    "top_power": "Powers at the top: of the load, of moving supports, of dampers",
    "base_power": "Power of a rotating base",
    "lock_power": "Power of the moment that locks the spin",
    "rotation_angles": "Angles (2.1) of the rotation vector of an end of a two-port, with two derivatives",
    "interface_load": "Load on the top plate of a two-port, by the moving end of its interface",
    "locking_moment": "Moment that locks the spin of a body, which the lower end of a two-port exerts",
    "lower_wrench": "Wrench of the lower end of a two-port, about its position",
    "upper_wrench": "Wrench of the upper end",
    "friction_after_slip": "Friction over the slip of a step in closed form: (3.18) integrated, (3.19)",
    "slip_work": "Work of friction over that slip",
    "load_work": "Work of the load over a step of such a model",
}


def block(rows: list[str]) -> str:
    """One displayed block of aligned rows."""
    inner = " \\\\\n".join(rows)
    return f"$$\n\\begin{{aligned}}\n{inner}\n\\end{{aligned}}\n$$"


def symbol(name: str) -> sp.Symbol:
    """A symbol of the stack."""
    return sp.Symbol(name, real=True)


def assembled() -> tuple[dict[str, sp.Expr], dict[sp.Symbol, str]]:
    """Explicit equations of the planar stack (2, 1, 0) without rim contact, springs and mass of the top.

    Returns the balances E1, E3 [N], t2 [N m] and dY [1/s], and the LaTeX of their symbols.
    """
    small = symbolic(Layout(2, 1, 0), Effects(dimension="planar", rims=False, bouc_wen="report"))
    without = {s: 0 for s in small.parameters if s.name.endswith("_T") or s.name in ("k_R", "c_R", "u_01", "T_1")}
    found = {}
    for rows in (small.residual, small.friction_rates):
        for name, value in zip(rows.names, rows.subs(without).expanded(), strict=True):
            found[name.partition("_")[0]] = value
    return found, dict(small.residual.latex_names)


def readable(expression: sp.Expr) -> sp.Expr:
    """An expression in few terms: products of sines and cosines combined, masses and forces factored out."""

    def by_angle(factor: sp.Expr) -> sp.Expr:
        return sp.collect(factor, sorted(factor.atoms(sp.sin, sp.cos), key=str), sp.factor)

    heads = [symbol(name) for name in ("m_2", "N_1", "F_1", "F_3")]
    return sp.collect(sp.expand(TR8(sp.expand(expression))), heads, by_angle)


def over_level_base(expression: sp.Expr) -> sp.Expr:
    """An expression for a base that translates without rotation: theta_1 = 0."""
    return expression.xreplace({symbol(f"{dots}theta_1"): sp.Integer(0) for dots in ("", "d", "dd")})


def assembled_latex() -> dict[str, list[str]]:
    """LaTeX of `assembled` for a base without rotation: the signed terms of each sum."""
    equations, names = assembled()
    rows = {}
    for name, expression in equations.items():
        terms = [to_latex(term, names) for term in readable(over_level_base(expression)).as_ordered_terms()]
        rows[name] = [term if i == 0 or term.startswith("-") else f"+ {term}" for i, term in enumerate(terms)]
    return rows


def assembled_section() -> list[str]:
    """The balances of the small stack."""
    parts = []
    for name, terms in assembled_latex().items():
        text, end = ASSEMBLED[name]
        rows = [f"& {term}" for term in terms]
        parts += [text, block([*rows[:-1], rows[-1] + end])]
    return parts


def module_of(program: str) -> str:
    """The module of the generator that has the function of a program, which has the name of the program."""
    (found,) = (module for module in MODULES if hasattr(module, program))
    return found.__name__.rpartition(".")[2]


def program_sections() -> list[str]:
    """The statements of every program."""
    shown = (
        Effects(dimension="planar", sliders="massless", bouc_wen="report"),
        Effects(top_rotation=True),
        Effects(bouc_wen="report"),
    )
    programs = {p.name: p for effects in shown for p in derive(ModelSpec(Layout.tfp(), effects)).programs}
    parts = []
    for name, title in TITLES.items():
        rows = [f"{left} &= {right}" for left, right in statements(programs[name])]
        parts += [f"### {title}", f"Program `{name}` of `generator/{module_of(name)}.py`."]
        parts += [block(rows[i : i + ROWS]) for i in range(0, len(rows), ROWS)]
    return parts


def place(text: str) -> str:
    """A place of the schedule, with bodies and surfaces numbered as in PEER 2017/07."""
    name, _, index = text.removesuffix("]").partition("[")
    return f"`{name}[{PLACES.get(index, index)}]`" if index else f"`{name}`"


def schedule_table(passes: Iterable[Pass]) -> str:
    """The calls of passes as a table."""
    rows = []
    for one in passes:
        for call in one.calls:
            reads, writes = (", ".join(map(place, places)) for places in (call.reads, call.writes))
            program = " or ".join(f"`{name}`" for name in call.programs)
            program += ", where it acts" if isinstance(call.by, If) else ""
            rows.append((OVER[one.over], program, reads, writes))
    return markdown_table(("over", "program", "reads", "writes"), rows)


def schedule_section() -> list[str]:
    """The schedules of a model with every effect of the report, and what uplift changes."""
    effects = Effects()
    uplift = condensed(Effects(uplift=True))
    return [
        SCHEDULE,
        *(CONDENSED, schedule_table(passes_of(condensed(effects)))),
        *(UPLIFT, schedule_table((*uplift["forces"], *uplift["moments"]))),
        *(BALANCES, schedule_table(passes_of(momentum_balances(effects)))),
        *(TWO_PORT, schedule_table(passes_of(ends(Effects(top_rotation=True))))),
    ]


def text() -> str:
    """The whole page."""
    return "\n\n".join([INTRODUCTION, *assembled_section(), *schedule_section(), PROGRAMS, *program_sections()]) + "\n"


def main() -> None:
    """Write the page, completely or not at all."""
    with replacing(TARGET) as temporary:
        temporary.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    parser(__doc__).parse_args()
    main()
