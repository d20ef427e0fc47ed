"""Write the tables of the fuzz campaign in docs/stability.md from the JSON files of fuzz.py, one per seed.

python benchmarks/fuzz_page.py [FILE ...]; default: benchmarks/results/fuzz-*.json
"""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from quick import docs_folder, parser

from msfp_gen.common.tables import markdown_table

RESULTS = Path(__file__).with_name("results")
MARKS = ("<!-- fuzz -->\n", "<!-- end of fuzz -->\n")
FALLBACKS = ("other_starts", "halved_newton_steps", "fresh_tangents", "newton_failures", "quasistatic_starts")


def summed(parts: list[dict[str, Any]], name: str) -> Counter[str]:
    """Sum of a table of counts over all files."""
    return sum((Counter(part[name]) for part in parts), Counter())


def tables(parts: list[dict[str, Any]]) -> str:
    """Tables of the final status of all and of sensible scenes, and of the fallbacks of Newton's method."""
    scenes, sensible = (sum(part[name] for part in parts) for name in ("scenes", "sensible"))
    faults, failures = ([x for part in parts for x in part[name]] for name in ("faults", "sensible_failures"))
    compared, undecided = (sum(part[name] for part in parts) for name in ("checked", "no_verdict"))
    ends, good = summed(parts, "ends"), summed(parts, "sensible_ends")
    counts, used = summed(parts, "counts"), summed(parts, "scenes_with")
    worst = max((part["largest_deviation"] or 0.0 for part in parts), default=0.0)
    drawn = ", ".join(f"{part['seed']}{' ' + part['which'] if part['which'] != 'all' else ''}" for part in parts)
    commits = ", ".join(sorted({part["commit"] for part in parts}))
    lines = [
        f"{scenes} scenes of {parts[0]['models']} models (seeds {drawn}; commit {commits}): {len(faults)} faults. Of {sensible} sensible ones "
        f"{len(failures)} failed, {100 * len(failures) / max(sensible, 1):.2g} %. {compared} successes were compared with "
        f"the second method; the largest deviation is {worst:.2f} of the permitted one. For {undecided} more the second method found no solution.",
        "",
        markdown_table(
            ("status", "scenes", "sensible"),
            ((end, str(number), str(good[end])) for end, number in ends.most_common()),
        ),
        "",
        markdown_table(
            ("fallback", "uses", "uses per thousand steps", "scenes that used it"),
            (
                (
                    f"`{name}`",
                    str(counts[name]),
                    f"{1000 * counts[name] / counts['steps']:.3g}",
                    f"{100 * used[name] / scenes:.1f} %",
                )
                for name in FALLBACKS
            ),
        ),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the tables between the marks of the page."""
    options = parser(__doc__)
    options.add_argument("files", nargs="*", type=Path, default=sorted(RESULTS.glob("fuzz-*.json")))
    parts = [json.loads(path.read_text(encoding="utf-8")) for path in options.parse_args().files]
    page = docs_folder() / "stability.md"
    text = page.read_text(encoding="utf-8")
    begin, end = (re.escape(mark) for mark in MARKS)
    whole = MARKS[0] + tables(parts) + MARKS[1]
    page.write_text(re.sub(begin + ".*" + end, lambda _: whole, text, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
