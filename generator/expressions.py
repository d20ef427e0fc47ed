"""Expressions over named statements: what a program computes, for a reader and for SymPy.

Nothing is expanded. A result is a symbol, and the statements before it say what the symbol is, each a small expression.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import sympy as sp

from .functions import ArcTan2, Clamp, Decay, Modulus, Select, Step, in_numpy, to_python
from .latex import to_latex
from .program import derivative

Definitions = dict[sp.Symbol, sp.Expr]
"""Symbol -> the expression that it stands for, over symbols before it."""
_SWITCHES = (ArcTan2, Clamp, Decay, Modulus, Select, Step)


@cache
def _switches(expression: sp.Expr) -> bool:
    return bool(expression.has(*_SWITCHES))


def folded(expression: sp.Expr) -> sp.Expr:
    """The expression with the functions of `functions.py` evaluated where their arguments are numbers."""
    if not expression.args or not _switches(expression):
        return expression
    expression = expression.func(*map(folded, expression.args))
    first = expression.args[0] if expression.args else expression
    if isinstance(expression, Select) and first.is_Number:
        return expression.args[1] if first > 0 else expression.args[2]
    if not isinstance(expression, _SWITCHES) or not all(arg.is_Number for arg in expression.args):
        return expression
    if isinstance(expression, ArcTan2):
        return sp.atan2(*expression.args)
    if isinstance(expression, Step):
        return sp.Integer(1 if first > 0 else 0)
    if isinstance(expression, Modulus):
        return abs(first)
    if isinstance(expression, Clamp):
        return sp.Max(-1, sp.Min(1, first))
    return sp.exp(-first) if first > 0 else sp.Integer(1)


def is_simple(expression: sp.Expr) -> bool:
    """Whether an expression needs no name: a number, a symbol or its negative."""
    if expression.is_Mul and len(expression.args) == 2:
        sign, of = expression.args
        return bool(of.is_Symbol and sign == -1)
    return bool(expression.is_Number or expression.is_Symbol)


@dataclass
class Tape:
    """Statements that are written one after the other; a statement that is there already is not repeated."""

    definitions: Definitions = field(default_factory=dict)
    _known: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)
    _count: int = 0

    def let(self, expression: sp.Expr, name: str | None = None) -> sp.Expr:
        """The symbol of an expression; name: that of a new one, `x_<count>` where it is None."""
        if is_simple(expression):
            return expression
        if expression not in self._known:
            if name is None:
                self._count += 1
                name = f"x_{self._count}"
            symbol = self._known[expression] = sp.Symbol(name, real=True)
            self.definitions[symbol] = expression
        return self._known[expression]


def _needed(definitions: Definitions, values: Iterable[sp.Expr]) -> Definitions:
    """The definitions on which expressions depend, in order."""
    needed = {s for value in values for s in value.free_symbols}
    kept = []
    for symbol, expression in reversed(definitions.items()):
        if symbol in needed:
            kept.append((symbol, expression))
            needed |= expression.free_symbols
    return dict(reversed(kept))


@dataclass(frozen=True, eq=False)
class Expressions:
    """A matrix of SymPy expressions over named statements.

    Attributes
    ----------
    names
        Names of the rows.
    values
        The matrix: symbols, numbers, or small expressions of symbols.
    statements
        Symbol -> what it stands for, in the order in which they are computed; only those that `values` needs.
    arguments
        The symbols that are given, in the groups in which `lambdify` takes them.
    latex_names
        Symbol -> its LaTeX, that of PEER 2017/07.

    """

    names: tuple[str, ...]
    values: sp.ImmutableMatrix
    statements: Definitions
    arguments: Mapping[str, tuple[sp.Symbol, ...]]
    latex_names: Mapping[sp.Symbol, str] = field(default_factory=dict)

    @classmethod
    def of(cls, rows: Mapping[str, Sequence[sp.Expr]], definitions: Definitions, **others: Any) -> Expressions:
        """Rows by name over definitions, of which those are kept that the rows need."""
        values = sp.ImmutableMatrix([list(row) for row in rows.values()])
        return cls(tuple(rows), values, _needed(definitions, values.flat()), **others)

    def __getitem__(self, name: str) -> Expressions:
        """One row by its name. Raises KeyError."""
        if name not in self.names:
            raise KeyError(name)
        return self._with({name: self.values.row(self.names.index(name))})

    def __repr__(self) -> str:
        rows, columns = self.values.shape
        return f"<Expressions {rows} x {columns}, {len(self.statements)} statements>"

    def __str__(self) -> str:
        """The statements and then the rows, a line each."""
        lines = [f"{symbol} = {expression}" for symbol, expression in self.statements.items()]
        rows = (self.values.row(i) for i in range(len(self.names)))
        return "\n".join([*lines, *(f"{name} = {_row(row)}" for name, row in zip(self.names, rows, strict=True))])

    def _with(self, rows: Mapping[str, Sequence[sp.Expr]], definitions: Definitions | None = None) -> Expressions:
        given = {"arguments": self.arguments, "latex_names": self.latex_names}
        return Expressions.of(rows, self.statements if definitions is None else definitions, **given)

    def _rows(self, change: Callable[[sp.Expr], sp.Expr]) -> dict[str, list[sp.Expr]]:
        return {name: [change(x) for x in self.values.row(i)] for i, name in enumerate(self.names)}

    def subs(self, values: Mapping[sp.Symbol, Any]) -> Expressions:
        """The same with numbers or expressions in place of given symbols; what becomes zero disappears."""
        known: dict[sp.Expr, sp.Expr] = {symbol: sp.sympify(value) for symbol, value in values.items()}
        left: Definitions = {}
        for symbol, expression in self.statements.items():
            new = folded(expression.xreplace(known))
            if is_simple(new) or not new.free_symbols:
                known[symbol] = new
            else:
                left[symbol] = new
        given = {
            name: tuple(symbol for symbol in symbols if symbol not in known) for name, symbols in self.arguments.items()
        }
        return replace(self._with(self._rows(lambda x: folded(x.xreplace(known))), left), arguments=given)

    def expanded(self) -> sp.ImmutableMatrix:
        """The matrix without statements, over given symbols alone: for small stacks, or after `subs`."""
        known: dict[sp.Expr, sp.Expr] = {}
        for symbol, expression in self.statements.items():
            known[symbol] = folded(expression.xreplace(known))
        return sp.ImmutableMatrix(self.values.applyfunc(lambda x: folded(x.xreplace(known))))

    def jacobian(self, symbols: Sequence[sp.Symbol]) -> Expressions:
        """Derivatives of a column, a row for each of its rows, by given symbols: statement by statement.

        Of a rim that does not act, and of a switch of friction, the derivative is zero. Raises ValueError for more
        than one column.
        """
        if self.values.shape[1] != 1:
            raise ValueError(f"jacobian: of a column alone, not of {self.values.shape[1]}; name a row and transpose it")
        tape = Tape(dict(self.statements), {e: s for s, e in self.statements.items()}, _last(self.statements))
        columns: dict[sp.Symbol, dict[int, sp.Expr]] = {s: {i: sp.Integer(1)} for i, s in enumerate(symbols)}
        for symbol, expression in self.statements.items():
            if found := {i: tape.let(e) for i, e in _by_columns(expression, columns, tape) if e != 0}:
                columns[symbol] = found
        rows = {
            name: dict(_by_columns(value, columns, tape)) for name, value in zip(self.names, self.values, strict=True)
        }
        zero = sp.Integer(0)
        matrix = {name: [row.get(i, zero) for i in range(len(symbols))] for name, row in rows.items()}
        return self._with(matrix, tape.definitions)

    def lambdify(self) -> Callable[..., Any]:
        """A function of NumPy of the groups of `arguments` that hold symbols, in their order.

        Each argument is an array of shape (..., symbols of the group), with leading axes that are broadcast; the result
        has shape (..., rows, columns), or (..., rows) of a column.
        """
        import numpy as np

        groups = [symbols for symbols in self.arguments.values() if symbols]
        rows, columns = self.values.shape
        shape = (rows,) if columns == 1 else (rows, columns)
        places: dict[str, Any] = {}
        exec(self._source([symbol for symbols in groups for symbol in symbols]), in_numpy(), places)
        function = places["function"]

        def evaluate(*given: Any) -> Any:
            if len(given) != len(groups):
                raise TypeError(f"give {len(groups)} arrays: {', '.join(k for k, v in self.arguments.items() if v)}")
            arrays = [np.asarray(array, dtype=float) for array in given]
            for array, symbols in zip(arrays, groups, strict=True):
                if array.shape[-1:] != (len(symbols),):
                    raise ValueError(f"an array of shape {array.shape}: its last axis has {len(symbols)} numbers")
            leading = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
            out = np.zeros((*leading, rows * columns))
            with np.errstate(divide="ignore", invalid="ignore"):  # of what is not chosen
                function(out, *(x for array in arrays for x in np.moveaxis(array, -1, 0)))
            return out.reshape(*leading, *shape)

        return evaluate

    def _source(self, given: Iterable[sp.Symbol]) -> str:
        """A function of Python that fills the last axis of `out` with the entries that are not zero."""
        lines = [f"{symbol.name} = {to_python(expression)}" for symbol, expression in self.statements.items()]
        entries = ((i, x) for i, x in enumerate(self.values.flat()) if x != 0)
        lines += [f"out[..., {i}] = {to_python(x)}" for i, x in entries] or ["pass"]
        arguments = ", ".join(["out", *(symbol.name for symbol in given)])
        return "\n    ".join([f"def function({arguments}):", *lines])

    def latex(self) -> str:
        r"""LaTeX: one `\begin{aligned}` block, in the symbols of PEER 2017/07; rows have their names."""
        body = " \\\\\n".join(f"{left} &= {right}" for left, right in self.latex_rows())
        return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"

    def latex_rows(self) -> Iterator[tuple[str, str]]:
        """Left and right sides of statements and rows as LaTeX."""
        for symbol, expression in self.statements.items():
            yield self.latex_of(symbol), to_latex(expression, self.latex_names)
        for i, name in enumerate(self.names):
            entries = [to_latex(x, self.latex_names) for x in self.values.row(i)]
            text = entries[0] if len(entries) == 1 else rf"\left({', '.join(entries)}\right)"
            yield (
                self.latex_names.get(sp.Symbol(name, real=True), rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"),
                text,
            )

    def latex_of(self, symbol: sp.Symbol) -> str:
        """LaTeX of a symbol."""
        return to_latex(symbol, self.latex_names)


def _row(row: sp.Matrix) -> str:
    entries = list(map(str, row))
    return entries[0] if len(entries) == 1 else f"({', '.join(entries)})"


def _last(definitions: Definitions) -> int:
    """The highest number of a name `x_<number>`."""
    return max((int(s.name[2:]) for s in definitions if s.name.startswith("x_")), default=0)


def _by_columns(
    expression: sp.Expr, columns: Mapping[sp.Symbol, Mapping[int, sp.Expr]], tape: Tape
) -> Iterator[tuple[int, sp.Expr]]:
    """Derivatives of an expression by the variables of `columns`, of which those of its symbols are known."""
    if isinstance(expression, Select):  # a product with the derivative that is not chosen, if infinite, is no number
        condition, *chosen = expression.args
        found = [dict(_by_columns(x, columns, tape)) for x in chosen]
        for i in sorted(set().union(*found)):
            yield i, Select(condition, *(tape.let(x.get(i, sp.Integer(0))) for x in found))
        return
    terms: dict[int, list[sp.Expr]] = {}
    for source in sorted(expression.free_symbols & columns.keys(), key=str):
        partial = folded(derivative(expression, source))
        if partial == 0:
            continue
        partial = tape.let(partial)
        for i, rate in columns[source].items():
            terms.setdefault(i, []).append(partial * rate)
    for i, summands in terms.items():
        yield i, sp.Add(*summands)
