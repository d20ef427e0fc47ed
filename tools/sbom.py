"""Write the bill of materials of the distribution, CycloneDX 1.6: `python tools/sbom.py ENVIRONMENT dist/*`.

cyclonedx-py states the packages of an environment in which the distribution is installed, with versions, licences and
who needs whom. Added are the sha256 of the archives, and what the archives themselves contain of others: three.js and
the headers of FMI.
SOURCE_DATE_EPOCH sets the time that is stated.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import QUICK, parser

ROOT = Path(__file__).resolve().parents[1]
THREE = ROOT / "msfp_gen" / "report" / "assets" / "three.min.js"
FMI = ROOT / "msfp_gen" / "embedding" / "assets" / "fmi" / "standard"


def packages(environment: Path) -> dict[str, Any]:
    """What cyclonedx-py finds in an environment, the distribution itself as the main component."""
    command = [sys.executable, "-m", "cyclonedx_py", "environment", "--pyproject", str(ROOT / "pyproject.toml")]
    command += ["--mc-type", "library", "--sv", "1.6", "--output-reproducible", str(environment)]
    document: dict[str, Any] = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return document


def archives(paths: list[Path]) -> list[dict[str, Any]]:
    """The files that are published, each with its hash."""
    return [
        {
            "type": "file",
            "bom-ref": path.name,
            "name": path.name,
            "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(path.read_bytes()).hexdigest()}],
        }
        for path in sorted(paths)
    ]


def contained() -> list[dict[str, Any]]:
    """three.js, with the version that the first line of its file states, and the headers of FMI with theirs."""
    version, licence = stated(THREE, r"/\*! three\.js (\S+) \| (\S+) \|")
    three = component("three", version, licence, f"pkg:npm/three@{version}")
    (second,) = stated(FMI / "fmi2Functions.h", r"FMI (2\.[\d.]+) Model Exchange")
    (third,) = stated(FMI / "fmi3Functions.h", r'fmi3Version "(\S+)"')
    home = "pkg:github/modelica/fmi-standard"
    return [three, *(component("fmi-standard", each, "BSD-2-Clause", f"{home}@v{each}") for each in (second, third))]


def stated(path: Path, pattern: str) -> tuple[str, ...]:
    """What a file says of itself; raises SystemExit where it does not."""
    found = re.search(pattern, path.read_text(encoding="utf-8"))
    if found is None:
        raise SystemExit(f"error: {path}: it does not state its version")
    return found.groups()


def component(name: str, version: str, licence: str, purl: str) -> dict[str, Any]:
    """A library of CycloneDX."""
    return {
        "type": "library",
        "bom-ref": f"{name}@{version}",
        "name": name,
        "version": version,
        "licenses": [{"license": {"id": licence}}],
        "purl": purl,
    }


def bill(environment: Path, paths: list[Path]) -> str:
    """The document; raises SystemExit where it does not follow the schema."""
    document = packages(environment)
    main, others = document["metadata"]["component"], contained()
    main["components"] = [*archives(paths), *others]
    main["purl"] = f"pkg:pypi/{main['name']}@{main['version']}"
    for node in document["dependencies"]:
        if node["ref"] == main["bom-ref"]:
            node["dependsOn"] = sorted([*node["dependsOn"], *(other["bom-ref"] for other in others)])
    document["dependencies"] += [{"ref": other["bom-ref"]} for other in others]
    text = json.dumps(document, indent=2, sort_keys=True) + "\n"
    error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    if error is not None:
        raise SystemExit(f"error: the bill of materials does not follow CycloneDX 1.6: {error}")
    return text


def main() -> None:
    """Write the file of -o; a quick run takes its own environment and writes nothing."""
    options = parser(__doc__)
    own = {"nargs": "?", "default": Path(sys.prefix)} if QUICK else {}
    options.add_argument("environment", type=Path, help="environment with the distribution and nothing else", **own)
    options.add_argument("archives", type=Path, nargs="*" if QUICK else "+", help="files that are published")
    options.add_argument("-o", "--output", type=Path, required=not QUICK, help="JSON file")
    given = options.parse_args()
    text = bill(given.environment, given.archives)
    if given.output is not None:
        given.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
