"""The tables of the fuzz campaign in docs/stability.md, from the JSON files that fuzz.py writes (one a seed).

python benchmarks/fuzz_page.py benchmarks/results/fuzz-*.json
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[1] / "docs" / "stability.md"
MARKS = ("<!-- fuzz -->\n", "<!-- end of fuzz -->\n")
RUNGS = ("other_starts", "halved_newton_steps", "fresh_tangents", "newton_failures", "quasistatic_starts")


def summed(parts: list[dict[str, Any]], name: str) -> Counter[str]:
    """A table of counts over all files."""
    return sum((Counter(part[name]) for part in parts), Counter())


def tables(parts: list[dict[str, Any]]) -> str:
    """Ends of all scenes and of the sensible ones, and what each rung of Newton's ladder did."""
    scenes, sensible = (sum(part[name] for part in parts) for name in ("scenes", "sensible"))
    faults, failures = ([x for part in parts for x in part[name]] for name in ("faults", "sensible_failures"))
    checked, silent = (sum(part[name] for part in parts) for name in ("checked", "no_verdict"))
    ends, good = summed(parts, "ends"), summed(parts, "sensible_ends")
    counts, used = summed(parts, "counts"), summed(parts, "scenes_with")
    worst = max((part["largest_deviation"] or 0.0 for part in parts), default=0.0)
    drawn = ", ".join(f"{part['seed']}{' ' + part['which'] if part['which'] != 'all' else ''}" for part in parts)
    commits = ", ".join(sorted({part["commit"] for part in parts}))
    lines = [
        f"{scenes} scenes of {parts[0]['models']} models (seeds {drawn}; commit {commits}): {len(faults)} faults. Of {sensible} sensible ones "
        f"{len(failures)} failed, {100 * len(failures) / max(sensible, 1):.2g} %. {checked} successes were held against the "
        f"second method, the largest deviation {worst:.2f} of what is allowed; for {silent} more it found no solution of its own.",
        "",
        "| end | scenes | sensible |",
        "|---|---|---|",
        *(f"| {end} | {number} | {good[end]} |" for end, number in ends.most_common()),
        "",
        "| rung | times | a thousand steps | scenes that used it |",
        "|---|---|---|---|",
        *(f"| `{rung}` | {counts[rung]} | {1000 * counts[rung] / counts['steps']:.3g} | {100 * used[rung] / scenes:.1f} % |"
          for rung in RUNGS),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write them between the marks of the page."""
    parts = [json.loads(Path(name).read_text(encoding="utf-8")) for name in sys.argv[1:]]
    text = PAGE.read_text(encoding="utf-8")
    begin, end = (re.escape(mark) for mark in MARKS)
    whole = MARKS[0] + tables(parts) + MARKS[1]
    PAGE.write_text(re.sub(begin + ".*" + end, lambda _: whole, text, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
