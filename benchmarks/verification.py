"""Fill the tables of docs/verification.md: `python benchmarks/verification.py [DIR]`, two minutes.

DIR is the folder to write to; default: the docs of this checkout.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from quick import QUICK, docs_folder, installed, labelled, parser, pick

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks"), str(ROOT / "tests")]
if not installed("pytest", "all tables, whose cases are those of the tests", "test"):
    raise SystemExit(0 if QUICK else 1)

from support.manufactured import Solution, fixed_steps, orders, resolved, solve  # noqa: E402
from support.manufactured_cases import (  # noqa: E402
    KNEES,
    STOREYS,
    Case,
    knees,
    quasistatic,
    resolvable,
    smooth,
    storey_orders,
)

from msfp_gen.common.output import replacing  # noqa: E402
from msfp_gen.common.tables import markdown_table  # noqa: E402

TEMPLATE = Path(__file__).with_name("verification.md.in")
HEAD = ("case", "quantity", "implicit (2)", "esdirk4 (4)", "dopri5 (5)", "error of the last run of each")
QUANTITIES = {"angles": "angles", "friction": "Y, Z", "separation": "separations", "temperature": "temperature"}
FEW = pick(None, ["planar"])  # cases of a quick run


def cases() -> Iterator[tuple[str, ...]]:
    """Rows of the manufactured solutions."""
    for name, case in smooth().items():
        if FEW is None or name in FEW:
            yield from measured(name, case, solve(case), case.steps)


def measured(
    name: str, case: Case, solution: Solution, steps: dict[str, tuple[int, ...]], last: bool = False
) -> Iterator[tuple[str, ...]]:
    """A row for each quantity: observed orders, and the least errors."""
    found = {method: fixed_steps(case, solution, method, counts, last) for method, counts in steps.items()}
    observed = {method: orders(errors, steps[method]) for method, errors in found.items()}
    for quantity in observed["implicit"]:
        cells = [f"{observed[m][quantity]:.2f}" if m in observed else "–" for m in ("implicit", "esdirk4", "dopri5")]
        least = ", ".join(f"{errors[-1][quantity]:.0e}" for errors in found.values())
        yield (name, QUANTITIES[quantity], *cells, least)


def on_four_surfaces() -> Iterator[tuple[str, ...]]:
    """Rows of the triple pendulum and of the building, against very short steps."""
    for name, (case, push) in resolvable().items():
        yield from measured(name, case, resolved(case, push), case.steps)
    building = {method: storey_orders(method) for method in STOREYS}
    least = ", ".join(f"{errors[-1]:.0e}" for errors, _ in building.values())
    cells = [f"{order:.2f}" for _, order in building.values()]
    yield ("three storeys on four double pendulums", "positions of the floors", *cells, "–", least)


def with_kinks() -> Iterator[tuple[str, ...]]:
    """Rows of the cases whose forces have a kink."""
    for name, (case, push) in knees().items():
        steps = {method: KNEES[method] for method in case.steps}
        yield from measured(name, case, resolved(case, push), steps, last=True)


def quasistatic_rows() -> Iterator[tuple[str, ...]]:
    """Error of quasi-static steps by their number."""
    counts = pick((80, 160, 320), (80, 160))
    for name, case in quasistatic().items():
        found = fixed_steps(case, solve(case), "implicit", counts, last=True, quasistatic=True)
        exact = name == "quasi-static"
        for quantity, order in orders(found, counts).items():
            errors = (f"{each[quantity]:.0e}" for each in found)
            yield (name, QUANTITIES[quantity], *errors, "exact" if exact else f"{order:.2f}")


def page() -> str:
    """Text of docs/verification.md."""
    parts = {
        "smooth": markdown_table(HEAD, cases()),
        "resolved": markdown_table(HEAD, on_four_surfaces()),
        "kinks": markdown_table(HEAD, with_kinks()),
        "quasistatic": markdown_table(("steps of", "quantity", "80", "160", "320", "order"), quasistatic_rows()),
        "count": str(len(smooth())),
        "date": f"{date.today()}",
    }
    text = TEMPLATE.read_text(encoding="utf-8")
    for name, value in parts.items():
        text = text.replace(f"{{{name}}}", value)
    return text


def main(folder: Path) -> None:
    text = page()
    with replacing(folder / "verification.md") as temporary:
        temporary.write_text(labelled(text), encoding="utf-8")


if __name__ == "__main__":
    options = parser(__doc__)
    options.add_argument("folder", nargs="?", type=Path, default=docs_folder())
    main(options.parse_args().folder)
