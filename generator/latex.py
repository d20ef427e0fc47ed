"""Programs as LaTeX, for pages; `docs/make_equations.py` writes them.

Only names are defined by hand: the mathematical symbol of each stored number (`SYMBOLS`), and the body or surface that
an argument of a program belongs to (`PLACES`). The equations are those that are emitted as C.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy as sp
from sympy.printing.latex import LatexPrinter

from .lower import needed_statements
from .program import AXES, Block, Program, Statement, Use

# Kind of record -> quantity -> LaTeX symbol: @ stands for the number of the body or surface, # for the component.
SYMBOLS: dict[str, dict[str, str]] = {
    "body_values": {"height": r"\ell_{@}", "centroid": r"z_{@}"},
    "sides": {
        "sign_lower": r"\sigma_{@-1}",
        "sign_upper": r"\sigma_{@}",
        "radius_lower": r"R_{@-1}",
        "radius_upper": r"R_{@}",
    },
    "body_parameters": {
        "c": r"c_{@}",
        "e": r"e_{@}",
        "m": r"m_{@}",
        "jt": r"\lambda_{1}^{@}",
        "ja": r"\lambda_{3}^{@}",
        "g": "g",
    },
    "surface_parameters": {
        "sign": r"\sigma_{@}",
        "R": r"R_{@}",
        "sc": r"s_{c@}",
        "mu": r"\mu_{@}",
        "dy": r"d_{@}",
        "td": r"T_{@}",
        "kc": r"k_{c@}",
        "cc": r"c_{c@}",
        "rs": r"r_{s@}",
        "pr": r"p_{s@}",
    },
    "coordinates": {
        "psi": r"\psi_{@}",
        "theta": r"\theta_{@}",
        "phi": r"\phi_{@}",
        "psi1": r"\dot{\psi}_{@}",
        "theta1": r"\dot{\theta}_{@}",
        "phi1": r"\dot{\phi}_{@}",
        "psi2": r"\ddot{\psi}_{@}",
        "theta2": r"\ddot{\theta}_{@}",
        "phi2": r"\ddot{\phi}_{@}",
    },
    "rim_coordinates": {
        "psi": r"\psi_{@}",
        "theta": r"\theta_{@}",
        "psi1": r"\dot{\psi}_{@}",
        "theta1": r"\dot{\theta}_{@}",
    },
    "body": {
        "t1": r"t_{1#}^{@}",
        "t2": r"t_{2#}^{@}",
        "t3": r"t_{3#}^{@}",
        "w": r"\omega_{@,#}",
        "wp": r"\omega'_{@,#}",
        "al": r"\dot{\omega}_{@,#}",
        "alp": r"\dot{\omega}'_{@,#}",
        "C": r"r_{@,#}^{c}",
        "V": r"\dot{r}_{@,#}^{c}",
        "A": r"\ddot{r}_{@,#}^{c}",
        "rc": r"r_{@,#}",
        "vc": r"\dot{r}_{@,#}",
        "ac": r"\ddot{r}_{@,#}",
        "sp": r"S_{\psi_{@}}",
        "cp": r"C_{\psi_{@}}",
        "st": r"S_{\theta_{@}}",
        "ct": r"C_{\theta_{@}}",
    },
    "force": {"F": r"P_{@,#}"},
    "moment": {"M": r"M_{@,#}"},
    "local_moment": {"M": r"M_{@,#}"},
    "relative": {"dw": r"\Delta\omega'_{@,#}"},
    "wrench": {"F": r"P_{@,#}", "M": r"M_{@,#}"},
    "contact_frame": {"p": r"p_{@,#}", "dw": r"\Delta\omega'_{@,#}"},
    "friction": {"Y": r"Y_{@}", "Z": r"Z_{@}"},
    "friction_force": {"Y": r"g_{1@}", "Z": r"g_{2@}"},
    "friction_previous": {"Y": r"Y^{0}_{@}", "Z": r"Z^{0}_{@}", "beta": r"\beta"},
    "friction_stage": {"Y": r"Y^{0}_{@}", "Z": r"Z^{0}_{@}", "tau": r"\tau_{@}", "rest": r"\rho_{@}"},
    "slip": {"Y": r"Y^{0}_{@}", "turn": r"\alpha_{@}", "beta": r"\beta"},
    "slip_end": {"Y": r"Y^{1}_{@}", "N": r"\bar{N}_{@}"},
    "friction_end": {"Y": r"Y_{@}", "g": r"g_{1@}"},
    "slip_work": {"stored": r"W_{f@}", "lost": r"W_{d@}"},
    "load_end": {"F": r"F_{E,#}^{@}", "M": r"M_{E,#}^{@}", "d": r"u_{#}^{@}", "tilt": r"\vartheta^{@}"},
    "load_work": {"work": "W_{E}"},
    "unknowns": {"psi": r"\tilde{\psi}_{@}", "theta": r"\tilde{\theta}_{@}", "N": r"N_{@}"},
    "contact": {
        "M": r"M_{@,#}",
        "dY": r"\dot{Y}_{@}",
        "dZ": r"\dot{Z}_{@}",
        "N": r"N_{@}",
        "Y": r"Y_{@}",
        "Z": r"Z_{@}",
        "sp": r"\sin\tilde{\psi}_{@}",
        "cp": r"\cos\tilde{\psi}_{@}",
        "st": r"\sin\tilde{\theta}_{@}",
        "ct": r"\cos\tilde{\theta}_{@}",
        "u": r"\tilde{u}_{@}",
        "v": r"\tilde{v}_{@}",
        "drill": r"D_{d@}",
    },
    "report_contact": {"p": r"p_{@,#}", "M": r"M_{@,#}", "dY": r"\dot{Y}_{@}", "dZ": r"\dot{Z}_{@}"},
    "top_parameters": {
        "sr": r"\eta_{V}",
        "k": "k_{T}",
        "c": "c_{T}",
        "kr": "k_{R}",
        "cr": "c_{R}",
        "m": "m_{T}",
        "jt": r"\lambda_{1}^{T}",
        "ja": r"\lambda_{3}^{T}",
        "h": "h_{T}",
        "g": "g",
        "mz": "m_{V}",
        "kv": "k_{V}",
        "cv": "c_{V}",
        "x0": "u_{0,#}",
    },
    "foot_previous": {"y": "y^{0}", "y1": r"\dot{y}^{0}", "beta": r"\beta^{0}"},
    "resting_foot": {"y": "y^{r}", "y1": r"\dot{y}^{r}"},
    "foot_stage": {"y": "y^{0}", "y1": r"\dot{y}^{0}", "beta": r"\beta", "mobility": "w", "share": r"\kappa"},
    "foot": {"y": "y", "y1": r"\dot{y}", "y2": r"\ddot{y}"},
    "top_force": {"F": r"F_{E,#}"},
    "top_moment": {"M": r"M_{E,#}"},
    "top_wrench": {"F": r"P_{@,#}", "M": r"M_{@,#}"},
    "rim": {"f": r"F_{c@,#}", "M": r"M_{c@,#}", "g": r"g_{@}", "dg": r"\dot{g}_{@}", "fc": r"F_{c@}"},
    "contact_angles": {"psi": r"\tilde{\psi}_{@}", "theta": r"\tilde{\theta}_{@}"},
    "gap": {"s": r"s_{@}", "g": r"g_{@}"},
    "base_motion": {"O": "u_{g#}", "U": r"\dot{u}_{g#}", "B": r"\ddot{u}_{g#}"},
    "friction_power": {"stored": r"\dot{E}_{f@}", "damped": r"D_{c@}", "lost": r"D_{f@}"},
    "rim_motion": {"g": r"g_{@}", "dg": r"\dot{g}_{@}"},
    "rim_energy": {"stored": r"E_{c@}", "lost": r"D_{r@}"},
    "restraint": {"stored": r"E_{@}", "settlement": r"s_{@}"},
    "top_power": {"load": r"\dot{W}_{E}", "prescribed": r"\dot{W}_{g}", "support": r"\dot{W}_{R}", "damped": r"D_{@}"},
    "turn": {"r": "r_{#}", "r1": r"\dot{r}_{#}", "r2": r"\ddot{r}_{#}"},
    "rotation_angles": {
        f"{name}{order or ''}": rf"\{dot}{{\{name}}}" if dot else rf"\{name}"
        for order, dot in enumerate(("", "dot", "ddot"))
        for name in ("psi", "theta", "phi")
    },
    "far_end": {"u": "u_{B,#}", "v": r"\dot{u}_{B,#}", "a": "a_{#}", "rest": "r_{B,#}", "axial": "W"},
    "end_wrench": {"F": "F_{@,#}", "M": "M_{@,#}"},
    "frame": {"C": "u_{A,#}"},
    "held": {"M": r"M^{\phi}_{@,#}"},
    "all_held": {"M": r"\Sigma M^{\phi}_{#}"},
    "lock": {"moment": r"M^{\phi}_{@}"},
    "power": {"power": r"\dot{W}_{@}"},
    "linear": {"r": r"\epsilon_{@,#}"},
    "angular": {"r": r"\eta_{@,#}"},
}
# Kinds with components along the basis of the body below; all other vectors are along E_1, E_2, E_3.
LOCAL_KINDS = {"contact_frame", "relative", "local_moment", "contact", "report_contact", "rim", "angular"}

# Program -> alias of an argument -> number of its body or surface.
PLACES: dict[str, dict[str, str]] = {
    "body_block": {"b": "k", "s": "k", "out": "k"},
    "forward": {"par": "k", "u": "k-1", "x": "k", "out": "k"},
    "contact_angles": {"c": r"\gamma", "out": r"\gamma"},
    "gap": {"par": r"\gamma", "a": r"\gamma+1", "out": r"\gamma"},
    "gap_at": {"par": r"\gamma", "x": r"\gamma+1", "out": r"\gamma"},
    "rim": {"par": r"\gamma", "x": r"\gamma+1", "out": r"\gamma"},
    "interface_force": {"par": "k", "b": "k", "up": "k", "out": "k-1"},
    "surface_local": {
        "b": r"\gamma",
        "a": r"\gamma+1",
        "x": r"\gamma+1",
        "y": r"\gamma",
        "tot": r"\gamma",
        "rim": r"\gamma",
        "out": r"\gamma",
    },
    "slip_rotation": {"a": r"\gamma+1", "x": r"\gamma+1", "y": r"\gamma", "out": r"\gamma"},
    "contact": {"par": r"\gamma", "h": r"\gamma", "loc": r"\gamma", "g": r"\gamma", "out": r"\gamma"},
    "moment_to_world": {"b": r"\gamma", "loc": r"\gamma", "out": r"\gamma"},
    "contact_stage": {"par": r"\gamma", "f": r"\gamma", "out": r"\gamma"},
    "report_contact": {"par": r"\gamma", "x": r"\gamma", "f": r"\gamma", "loc": r"\gamma", "out": r"\gamma"},
    "report_wrench": {"b": r"\gamma", "c": r"\gamma", "rim": r"\gamma", "out": r"\gamma"},
    "spring_stage": {"par": "T", "f": "T", "out": "T"},
    "resting_foot": {"par": "T", "b": "n", "out": "T"},
    "foot": {"par": "T", "b": "n", "y": "T", "out": "T"},
    "top_wrench": {"par": "T", "y": "T", "b": "n", "x": "n", "fe": "E", "me": "E", "out": "n"},
    "friction_power": {"par": r"\gamma", "c": r"\gamma", "out": r"\gamma"},
    "rim_energy": {"par": r"\gamma", "rim": r"\gamma", "out": r"\gamma"},
    "restraint": {"par": "T", "b": "n", "f": "T", "out": "T"},
    "top_power": {"par": "T", "b": "n", "f": "T", "x": "n", "base": "g", "fe": "E", "me": "E", "out": "T"},
    "base_power": {"b": "1", "base": "g", "f": "1", "m": "1", "out": "1"},
    "lock_power": {"b": "k", "l": "k", "out": "k"},
    "rotation_angles": {"t": "", "out": ""},
    "interface_load": {"par": "T", "e": "B", "out": "E"},
    "locking_moment": {"b": "k", "l": "k", "out": "k"},
    "lower_wrench": {"e": "A", "b": "1", "f": "1", "m": "1", "h": "", "out": "A"},
    "upper_wrench": {"e": "B", "b": "n", "f": "n", "m": "n", "out": "B"},
    "friction_after_slip": {"par": r"\gamma", "s": r"\gamma", "loc": r"\gamma", "out": r"\gamma"},
    "slip_work": {"par": r"\gamma", "s": r"\gamma", "e": r"\gamma", "out": r"\gamma"},
    "load_work": {"a": "0", "e": "1", "out": ""},
    "linear_balance": {"par": "k", "b": "k", "lo": "k-1", "up": "k", "out": "k"},
    "angular_balance": {"par": "k", "b": "k", "lo": "k-1", "ml": "k-1", "up": "k", "mu": "k", "out": "k"},
}
# (program, alias) -> kind of record, where it differs from the name of the block.
KINDS = {
    ("moment_to_world", "loc"): "local_moment",
    ("interface_load", "out"): "top_force",
    ("locking_moment", "out"): "held",
    ("lower_wrench", "e"): "frame",
    ("lower_wrench", "h"): "all_held",
    **{(name, "fe"): "top_force" for name in ("top_wrench", "top_power")},
    **{(name, "me"): "top_moment" for name in ("top_wrench", "top_power")},
}


class Latex(LatexPrinter):  # type: ignore[misc]
    """LaTeX printer of SymPy with the functions of `functions.py`."""

    def _function(self, name: str, expr: sp.Function, exp: Any) -> str:
        text = rf"\operatorname{{{name}}}\left({', '.join(self._print(a) for a in expr.args)}\right)"
        return text if exp is None else rf"{text}^{{{exp}}}"

    def _print_Step(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("H", expr, exp)

    def _print_Select(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("if", expr, exp)

    def _print_Decay(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("decay", expr, exp)

    def _print_Clamp(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("clamp", expr, exp)

    def _print_ArcTan2(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("atan2", expr, exp)

    def _print_Stumpff(self, expr: sp.Function, exp: Any = None) -> str:
        text = rf"c_{{{expr.args[0]}}}\left({self._print(expr.args[1])}\right)"
        return text if exp is None else rf"{text}^{{{exp}}}"

    def _print_Length(self, expr: sp.Function, exp: Any = None) -> str:
        return str(self._print(sp.sqrt(expr.args[0] ** 2 + expr.args[1] ** 2)))

    def _print_Modulus(self, expr: sp.Function, exp: Any = None) -> str:
        return self._function("abs", expr, exp)


def to_latex(expression: sp.Expr, names: Mapping[sp.Symbol, str]) -> str:
    """LaTeX of an expression; `names` is the LaTeX of each symbol."""
    return str(Latex({"symbol_names": dict(names)}).doprint(expression))


def field_names(block: Block, kind: str, index: str) -> dict[str, str]:
    """Stored field of a block -> its LaTeX for body or surface `index`; fields without a symbol are left out."""
    marks = dict(zip(AXES, "123" if kind in LOCAL_KINDS else AXES, strict=True))
    out: dict[str, str] = {}
    for quantity, symbol in SYMBOLS[kind].items():
        parts = block.quantities[quantity]
        for part in parts:
            if isinstance(part, str):
                out[part] = symbol.replace("@", index).replace("#", marks[part[-1]] if len(parts) == 3 else "")
    return out


def names_of(program: Program, use: Use) -> dict[str, str]:
    """Stored field of one argument of a program -> its LaTeX."""
    kind = KINDS.get((program.name, use.alias), use.block.name)
    return field_names(use.block, kind, PLACES[program.name][use.alias])


def result_statements(program: Program, results: Iterable[str]) -> tuple[Statement, ...]:
    """Statements on which the named results depend, in order of execution."""
    symbols = {s for name in results for s in program.results[name].free_symbols}
    return needed_statements(program.statements, symbols)


def statements(program: Program) -> list[tuple[str, str]]:
    """Left and right sides of the statements of a program as LaTeX; intermediate values are x_1, x_2, ..."""
    assert program.output is not None
    names = {
        sp.Symbol(f"{use.alias}_{field}", real=True): text
        for use in program.inputs
        for field, text in names_of(program, use).items()
    }
    results = names_of(program, program.output)
    names.update({program.results[field]: text for field, text in results.items() if program.results[field].is_Symbol})
    rows: list[tuple[str, str]] = []
    count = 0
    for statement in result_statements(program, results):
        if statement.target not in names:
            count += 1
            names[statement.target] = f"x_{{{count}}}"
        rows.append((names[statement.target], to_latex(statement.expression, names)))
    return rows
