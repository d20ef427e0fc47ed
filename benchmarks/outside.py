"""Comparisons beyond their tolerance, by what they come from: part of `validation.py`.

Every one of them belongs to one cause. Where the cause can be taken out of one side, other comparisons do so, and
stand beside it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from msfp_gen.common.tables import markdown_table

HEAD = ("compared with", "case", "beyond the tolerance", "largest", "what it comes from", "without it")
Comparison = dict[str, str]  # a row of results/comparisons.csv


class Cause(NamedTuple):
    """What sets comparisons apart.

    Attributes:
        source: of the comparisons.
        where: pattern that their case and quantity match.
        label: of these cases on the page.
        words: the cause.
        without: source of the same cases without the cause; empty where there is none.
    """

    source: str
    where: str
    label: str
    words: str
    without: str = ""


CAUSES = (
    Cause(
        "friction circles",
        r"fenz-test1 F/N|monotonic push u\*\*",
        "`fenz-test1`; u** of the monotonic push",
        "The closed form slides at once. The run yields first: test 1 moves by 1.2 mm only, and the last surface of a "
        "push begins to slide gradually.",
        "friction circles, ours with a tenth of the yield displacement",
    ),
    Cause(
        "Fenz & Constantinou 2008",
        r"triple pendulum F/W",
        "triple pendulum",
        "The formula lets friction act at the pivot, at R − h in place of R.",
        "Fenz & Constantinou 2008, with the arms of friction",
    ),
    Cause(
        "Lee & Constantinou 2016",
        r"quintuple pendulum F/W",
        "quintuple pendulum",
        "The same, with larger h in the tall stack.",
        "Lee & Constantinou 2016, with the arms of friction",
    ),
    Cause(
        "OpenSees TripleFrictionPendulum",
        r"largest F/W$",
        "all five scenes",
        "Friction acts at the pivot there.",
        "OpenSees TripleFrictionPendulum, ours with friction at the pivot",
    ),
    Cause(
        "OpenSees TripleFrictionPendulum, ours with friction at the pivot",
        r"force along E[12] \[N\]$",
        "`fenz-test2`, `fenz-test3`, `becker-eight-125`",
        "Behind reversals, where the force falls by twice the friction within a millimetre or two: the element has one "
        "yield displacement for the bearing, the scenes have one for each surface, larger at the inner ones.",
        "OpenSees TripleFrictionPendulum, ours with friction at the pivot and the yield displacement of the element",
    ),
    Cause(
        "OpenSees singleFPBearing, transient",
        r"mass on a shaken base, R 2 m",
        "mass on a shaken base, R 2 m",
        "A displaced mass is lifted by the dish, which changes the normal force. The element has this only with an option.",
        "OpenSees singleFPBearing, transient, with vertical displacement",
    ),
    Cause(
        "OpenSees singleFPBearing, transient, with vertical displacement",
        r"R 2 m, friction by velocity force along E2",
        "the same, friction by velocity",
        "Two instants behind a slow turn of the motion, which changes its direction there within a tenth of a second: the "
        "stiffness of the element before sliding is constant, here it follows the friction of the present speed.",
    ),
    Cause(
        "MASTODON, gold table",
        r"pushed at 0\.5 Hz, T force",
        "friction by temperature",
        "One instant 1.2 mm behind a reversal, where the force falls by 1 MN within 2 mm: the stiffness before sliding "
        "does not fall with the friction of the heated surface there, here it does.",
    ),
    Cause(
        "MASTODON, gold table",
        r"three axes, [yz] force",
        "three axes, begin of sliding",
        "8 ms in two directions: friction follows the total velocity there, so that the force climbs along the elastic "
        "line to the friction of fast sliding, at 1.0 mm. Here it follows the slip, which begins at 0.5 mm.",
    ),
)


def outside(comparisons: Sequence[Comparison]) -> list[Comparison]:
    """Those beyond their tolerance."""
    return [one for one in comparisons if abs(float(one["difference"])) > float(one["tolerance"])]


def belongs(one: Comparison, cause: Cause) -> bool:
    """Whether a comparison is of the source and the cases of a cause."""
    return one["source"] == cause.source and re.search(cause.where, f"{one['case']} {one['quantity']}") is not None


def largest(comparisons: Sequence[Comparison]) -> str:
    """The largest difference, in per cent."""
    return f"{max(abs(float(one['difference'])) for one in comparisons):.1%}"


def without(comparisons: Sequence[Comparison], cause: Cause) -> list[Comparison]:
    """The comparisons of the same cases from which the cause is taken out."""
    cases = {one["case"] for one in outside(comparisons) if belongs(one, cause)}
    own = [one for one in comparisons if one["source"] == cause.without and one["case"] in cases]
    return [one for one in own if re.search(cause.where, f"{one['case']} {one['quantity']}")]


def causes(comparisons: Sequence[Comparison]) -> str:
    """The table of causes.

    Raises:
        ValueError: a comparison beyond its tolerance belongs to no cause, or to several.
    """
    found = outside(comparisons)
    for one in found:
        if sum(belongs(one, cause) for cause in CAUSES) != 1:
            raise ValueError(f"{one['case']}, {one['source']}, {one['quantity']} {one['at']}: not of one cause")
    rows = []
    for cause in CAUSES:
        own = [one for one in found if belongs(one, cause)]
        total = sum(belongs(one, cause) for one in comparisons)
        rest = without(comparisons, cause)
        other = f"{len(outside(rest))} of {len(rest)}, largest {largest(rest)}" if rest else "–"
        if own:
            rows.append((cause.source, cause.label, f"{len(own)} of {total}", largest(own), cause.words, other))
    return markdown_table(HEAD, rows)
