"""Target spectra for scaling: tables of period and acceleration, and the elastic spectrum of EN 1998-1."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from msfp_gen.common.arrays import Array
from msfp_gen.common.fields import Text
from msfp_gen.common.quantities import to_si
from msfp_gen.errors import InputError
from msfp_gen.motions.checks import finite
from msfp_gen.motions.records.csv_table import COLUMN, first_line
from msfp_gen.motions.records.text import read_lines

Pairs = tuple[tuple[float, float], ...]  # period [s] and pseudo-acceleration [m/s^2]
# EN 1998-1, tables 3.2 (type 1) and 3.3 (type 2), recommended values: type, ground -> S, T_B, T_C, T_D [s].
EN1998 = {
    (1, "A"): (1.00, 0.15, 0.40, 2.0), (1, "B"): (1.20, 0.15, 0.50, 2.0), (1, "C"): (1.15, 0.20, 0.60, 2.0),
    (1, "D"): (1.35, 0.20, 0.80, 2.0), (1, "E"): (1.40, 0.15, 0.50, 2.0),
    (2, "A"): (1.00, 0.05, 0.25, 1.2), (2, "B"): (1.35, 0.05, 0.25, 1.2), (2, "C"): (1.50, 0.10, 0.25, 1.2),
    (2, "D"): (1.80, 0.10, 0.30, 1.2), (2, "E"): (1.60, 0.05, 0.25, 1.2),
}  # fmt: skip
EN1998_END = 4.0  # longest period of the formulas [s]
ROWS = "give the path of a CSV file (`period [s], Sa [g]`), or two or more pairs of a period [s] and m/s^2"


@dataclass(frozen=True)
class Tabulated(Text):
    """Rule of a field that takes a table of periods and accelerations: the path of a file, or pairs."""

    def parse(self, value: object, *, text: bool = False) -> Any:
        """A path as it is, pairs as tuples of numbers; raises ValueError whose text is the remedy."""
        if isinstance(value, str):
            return super().parse(value, text=text)
        try:
            pairs = tuple((float(period), float(acceleration)) for period, acceleration in value)  # type: ignore[attr-defined]
        except (TypeError, ValueError):
            raise ValueError(ROWS) from None
        if len(pairs) < 2:
            raise ValueError(ROWS)
        return pairs


def read_spectrum(path: str | Path) -> Pairs:
    """The target spectrum in a CSV file: columns of the period and of one acceleration, with units in the header.

    Lines that begin with # are comments; further columns are an error. Raises InputError that names file and line.
    """
    lines = read_lines(Path(path))
    head, header = first_line(lines, "period [s], Sa [g]")
    matches = [COLUMN.fullmatch(text) for text in header.split(",")]
    if len(matches) != 2 or None in matches or matches[0] is None or matches[0][1].lower() not in ("period", "t"):
        lines.fail(head, f"the header is {header.strip()[:48]!r}; give two columns with units: period [s], Sa [g]")
    factors = []
    for match, unit in zip(matches, ("s", "m/s^2"), strict=True):
        assert match is not None
        try:
            factors.append(to_si(f"1 {(match[2] or match[3] or '').strip()}", unit))
        except ValueError as error:
            lines.fail(head, f"column {match[1]}: {error}")
    rows = []
    for index in range(head + 1, len(lines)):
        if lines[index].strip() and not lines[index].lstrip().startswith("#"):
            fields = lines[index].split(",")
            if len(fields) != 2:
                lines.fail(index, f"{len(fields)} columns, the header names 2")
            period, acceleration = lines.numbers(index, fields)
            rows.append((period * factors[0], acceleration * factors[1]))
    return tuple(rows)


def check_pairs(pairs: Pairs) -> None:
    """Raise InputError unless periods rise and all numbers are positive."""
    table = np.array(pairs, dtype=float).reshape(-1, 2)
    positive = np.all(np.isfinite(table)) and np.all(table > 0)
    if len(table) < 2 or not positive or not np.all(np.diff(table[:, 0]) > 0):
        raise InputError("scale_to.spectrum: give two or more rows of rising periods, and accelerations above zero")


def tabulated_spectrum(period: ArrayLike, pairs: Pairs) -> Array:
    """The acceleration at periods within a table, linear between its rows in logarithms: shape (p,), [m/s^2]."""
    table = np.log(np.array(pairs))
    return np.asarray(np.exp(np.interp(np.log(np.asarray(period, dtype=float)), *table.T)))


def en1998_spectrum(period: ArrayLike, ag: float, ground: str, spectrum_type: int = 1, damping: float = 0.05) -> Array:
    """Horizontal elastic response spectrum of EN 1998-1:2004, 3.2.2.2 (3.2)-(3.6): pseudo-acceleration.

    Args:
        period: shape (p,), at most 4 [s].
        ag: design ground acceleration on ground of type A, a_g = gamma_I a_gR, in any unit of acceleration.
        ground: type of the ground, A to E.
        spectrum_type: 1, or 2 for magnitudes of at most 5.5.
        damping: ratio [-]; it gives eta = sqrt(10/(5 + 100 damping)), at least 0.55.

    Returns:
        ndarray, shape (p,), in the unit of `ag`.

    Raises:
        InputError: an unknown ground or type, or a period below 0 or above 4 s.
    """
    t = finite("period", period)
    if (spectrum_type, ground) not in EN1998:
        raise InputError(f"ground = {ground!r}, spectrum_type = {spectrum_type!r}: give A to E, and 1 or 2")
    if not np.all((t >= 0) & (t <= EN1998_END * (1 + 1e-12))):
        raise InputError(f"period: EN 1998-1 gives the spectrum from 0 to {EN1998_END:g} s; give periods within")
    soil, t_b, t_c, t_d = EN1998[spectrum_type, ground]
    plateau = 2.5 * max(np.sqrt(10.0 / (5.0 + 100.0 * damping)), 0.55)
    safe = np.maximum(t, 1e-12)
    pieces = [t <= t_b, t <= t_c, t <= t_d]
    shapes = [1.0 + t / t_b * (plateau - 1.0), np.full_like(t, plateau), plateau * t_c / safe]
    return np.asarray(ag * soil * np.select(pieces, shapes, plateau * t_c * t_d / safe**2))
