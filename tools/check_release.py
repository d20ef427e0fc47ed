"""Whether the files of the checkout are those of a release: `python tools/check_release.py 0.3.0`.

Compared are pyproject.toml, CITATION.cff, CHANGELOG.md and the row of the validation. Everything that does not fit is
printed, one line each, and the exit code is 2.
"""

from __future__ import annotations

import csv
import re
import sys
import tomllib
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import QUICK, parser

ROOT = Path(__file__).resolve().parents[1]
FORM = r"\d+\.\d+\.\d+(?:(?:a|b|rc)\d+)?"


def problems(version: str, root: Path = ROOT) -> list[str]:
    """What does not fit `version`, one line each: file, what it says, and what to do."""
    if not re.fullmatch(FORM, version):
        return [f"version: {version!r} is not of the form 1.2.3 or 1.2.3rc1"]
    found = []
    stated = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    if stated != version:
        found.append(f"pyproject.toml: version is {stated}, not {version}; change it there")
    citation = (root / "CITATION.cff").read_text(encoding="utf-8")
    cited = re.search(r"^version: (.+)$", citation, re.MULTILINE)
    if cited is None or cited[1] != version:
        found.append(f"CITATION.cff: version is {cited and cited[1]}, not {version}; change it there")
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    first = re.search(r"^## (.+)$", changes, re.MULTILINE)
    dated = re.fullmatch(rf"{re.escape(version)} \((\d{{4}}-\d\d-\d\d)\)", first[1] if first else "")
    if dated is None:
        found.append(f"CHANGELOG.md: the first heading is {first and first[1]!r}, not '{version} (YYYY-MM-DD)'")
    elif f"\ndate-released: {dated[1]}\n" not in citation:
        found.append(f"CITATION.cff: date-released is not {dated[1]}, the date in CHANGELOG.md")
    history = root / "benchmarks" / "results" / "validation.csv"
    if version not in {row["version"] for row in csv.DictReader(history.read_text(encoding="utf-8").splitlines())}:
        found.append(f"{history.name}: no row for {version}; run `python benchmarks/validation.py`")
    return found


def main() -> None:
    """Print what does not fit, and end with code 2 where something does not."""
    options = parser(__doc__)
    options.add_argument("version", nargs="?" if QUICK else None, default="0.0.0", help="such as 0.3.0, without a v")
    found = problems(options.parse_args().version)
    for line in found:
        print(line, file=sys.stderr)
    if found and not QUICK:
        raise SystemExit(2)


if __name__ == "__main__":
    main()
