"""`symbolic`: the equations of a stack as SymPy expressions, in the symbols of PEER 2017/07."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from msfp_gen.common.arrays import Array
from msfp_gen.common.errors import InputError
from msfp_gen.model.compiled import bodies_and_surfaces, top_values
from msfp_gen.scene.friction_parameters import check_bearing
from msfp_gen.scene.top import is_sprung
from msfp_gen.specification import contract
from msfp_gen.specification.layout import Effects, Layout, ModelSpec

if TYPE_CHECKING:
    import sympy as sp

    from msfp_gen.generator.expressions import Expressions
    from msfp_gen.scene.bearing import Bearing
    from msfp_gen.scene.top import Top

SECTIONS = {
    "position": "named points (3.1)-(3.11) along E1, E2, E3 [m]",
    "velocity": "their rates [m/s]",
    "acceleration": "their second derivatives [m/s^2]",
    "rotation": "angular velocities (3.12) [rad/s] and their rates [rad/s^2] along E1, E2, E3",
    "residual": "momentum balances (3.26)-(3.29), left side less right side [N], [N m]",
    "friction_rates": "rates of the friction state (3.18) [1/s]",
}
"""Attribute of a `SymbolicModel` -> what it holds."""


@dataclass(frozen=True, eq=False)
class SymbolicModel:
    """The equations of one layout with one set of effects, as SymPy expressions; made by `symbolic`.

    They are the programs that become C, evaluated with symbols. Nothing is expanded: a result is an `Expressions`, a
    matrix over named statements, with `subs`, `expanded`, `jacobian`, `lambdify` and `latex`. In a planar model what
    leaves the E1-E3 plane is zero, and has no symbol.

    Attributes
    ----------
    spec
        Layout and effects.
    state
        Angles psi_k, theta_k, phi_k of bodies 2..n [rad], their rates dpsi_k, ... [rad/s], then Y_g, Z_g of each
        surface [-].
    unknowns
        (2.119): accelerations ddpsi_k, ... [rad/s^2], position of the normals psit_g, thetat_g [rad], N_g [N].
    inputs
        Base translations u_g1, ... with rates and accelerations, angles psi_1, ... of the base likewise; force F_1, ...
        and moment M_1, ... on the top plate at r_nn. SI units.
    parameters
        Values of bodies, surfaces and top, and gravity, on which something depends [SI].
    position, velocity, acceleration
        Three columns; a row for each named point (r_01, r_1, r_11, r_1c, ...), under the names of `Model.kinematics`.
    rotation
        Rows omega_k, omega'_k, alpha_k, alpha'_k of three columns.
    residual
        Rows E1_k, E2_k, E3_k [N], t1_k, t2_k, t3_k [N m] of bodies 2..n: see `Model.residual`.
    friction_rates
        Rows dY_g, dZ_g.

    """

    spec: ModelSpec
    state: tuple[sp.Symbol, ...]
    unknowns: tuple[sp.Symbol, ...]
    inputs: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    position: Expressions
    velocity: Expressions
    acceleration: Expressions
    rotation: Expressions
    residual: Expressions
    friction_rates: Expressions
    _values: Mapping[sp.Symbol, tuple[str, int, str]]

    def __repr__(self) -> str:
        return f"SymbolicModel({self.spec.key})"

    def jacobian(self, wrt: str = "unknowns") -> Expressions:
        """Jacobian of `residual`; wrt: "unknowns", "state" or "inputs". Raises InputError for another."""
        if wrt not in ("unknowns", "state", "inputs"):
            raise InputError(f"wrt = {wrt!r}: give one of unknowns, state, inputs")
        return self.residual.jacobian(getattr(self, wrt))

    def values(self, bearing: Bearing, top: Top | None = None) -> Array:
        """The values of `parameters` for a bearing and a top (None: no springs, no mass), shape (parameters,) [SI].

        Raises InputError where the bearing does not belong to this model, and for a top on a vertical spring, which
        these equations do not have.
        """
        layout, effects = self.spec.layout, self.spec.effects
        if bearing.layout != layout:
            raise InputError(f"bearing.layout = {bearing.layout.name}: these equations are of {layout.name}")
        if top is not None and is_sprung(top):
            raise InputError("top.vertical_stiffness: the symbolic equations have no vertical spring; leave it out")
        check_bearing(effects.law, effects.friction, effects.spin, bearing)
        arrays = bodies_and_surfaces(bearing, effects, top)
        names = contract.names(contract.BODY), contract.surface_values(effects), contract.names(contract.TOP)
        rows = {"body": arrays[0], "surface": arrays[1], "top": top_values(top)[None]}
        found: dict[tuple[str, int, str], float] = {("", 0, "gravity"): bearing.gravity}
        for (kind, values), columns in zip(rows.items(), names, strict=True):
            for i, row in enumerate(values):
                number = 0 if kind == "top" else i + 1
                found |= {(kind, number, name): float(x) for name, x in zip(columns, row, strict=True)}
        return np.array([found[self._values[symbol]] for symbol in self.parameters])

    def subs(self, bearing: Bearing, top: Top | None = None) -> SymbolicModel:
        """The equations with the numbers of a bearing and a top; errors as in `values`."""
        numbers = dict(zip(self.parameters, self.values(bearing, top).tolist(), strict=True))
        changed: dict[str, Any] = {name: getattr(self, name).subs(numbers) for name in SECTIONS}
        return replace(self, parameters=(), **changed)

    def __str__(self) -> str:
        """All sections as text: a line for each row, after the statements that no section before it has."""
        inputs = ("state", "unknowns", "inputs", "parameters")
        lines = [f"# {name}\n{', '.join(map(str, getattr(self, name)))}" for name in inputs if getattr(self, name)]
        lines += [f"# {name}: {SECTIONS[name]}\n{section}" for name, section in self._sections()]
        return "\n\n".join(lines)

    def latex(self) -> str:
        """A LaTeX document of all sections, in the symbols of PEER 2017/07."""
        parts = []
        for name, section in self._sections():
            rows = " \\\\\n".join(f"{left} &= {right}" for left, right in section.latex_rows())
            title = f"{name.capitalize().replace('_', ' ')}: {SECTIONS[name].replace('^2', '$^2$')}"
            parts.append(f"\\section*{{{title}}}\n\\begin{{align*}}\n{rows}\n\\end{{align*}}")
        head = "\\documentclass{article}\n\\usepackage{amsmath}\n\\usepackage[landscape,margin=15mm]{geometry}\n"
        return "\n".join([f"{head}\\allowdisplaybreaks\n\\begin{{document}}", *parts, "\\end{document}"])

    def _sections(self) -> Iterator[tuple[str, Expressions]]:
        """Name and content of each section, without the statements of those before it."""
        written: set[sp.Symbol] = set()
        for name in SECTIONS:
            section: Expressions = getattr(self, name)
            new = {symbol: value for symbol, value in section.statements.items() if symbol not in written}
            yield name, replace(section, statements=new)
            written |= set(new)


def symbolic(layout: Layout, effects: Effects | None = None) -> SymbolicModel:
    """The equations of a stack as SymPy expressions, from the programs that become C.

    Parameters
    ----------
    layout, effects
        They determine the equations; `effects=None` means `Effects()`.

    Raises
    ------
    InputError
        With effects that these equations do not have: uplift, a rotating top, a friction law with a memory.

    """
    effects = Effects() if effects is None else effects
    if effects.uplift:
        raise InputError("effects.uplift = True: the symbolic equations are of closed surfaces; leave uplift out")
    if effects.top_rotation:
        raise InputError("effects.top_rotation = True: the symbolic equations have a support at rest; leave it out")
    if effects.law is not None and effects.law.memory is not None:
        raise InputError(
            f"effects.friction = {effects.friction!r}: the symbolic equations have no temperatures or paths; "
            "give a law without them"
        )
    from msfp_gen.generator.symbolic import assemble

    found = assemble(ModelSpec(layout, effects))
    points = {letter: {k: v for k, v in found.points.items() if k[0] == letter} for letter in "rva"}
    rows = {
        **{name: points[letter] for name, letter in zip(("position", "velocity", "acceleration"), "rva", strict=True)},
        "rotation": found.rotations,
        "residual": found.balances,
        "friction_rates": found.rates,
    }
    return SymbolicModel(
        spec=found.spec,
        state=tuple(found.state),
        unknowns=tuple(found.unknowns),
        inputs=tuple(found.inputs),
        parameters=tuple(found.parameters),
        _values=found.parameters,
        **{name: found.expressions(rows[name]) for name in SECTIONS},
    )
