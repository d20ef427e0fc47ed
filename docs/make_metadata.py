"""Write codemeta.json and .zenodo.json from pyproject.toml and CITATION.cff: `python docs/make_metadata.py`.

Both files repeat what the two sources say, in the form that archives and search engines read.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import yaml

sys.path.append(str(Path(__file__).resolve().parents[1] / "benchmarks"))
from quick import docs_folder, parser

ROOT = Path(__file__).resolve().parents[1]
# Keys of CITATION.cff and of [project] in pyproject.toml whose values agree.
SHARED = ("version", "license", "keywords")


def sources() -> tuple[dict[str, Any], dict[str, Any]]:
    """The table [project] of pyproject.toml, and CITATION.cff.

    Raises:
        SystemExit: where the two disagree.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    for key in SHARED:
        if project[key] != citation[key]:
            raise SystemExit(f"error: {key}: {project[key]!r} in pyproject.toml, {citation[key]!r} in CITATION.cff")
    if names(project["authors"]) != names(citation["authors"]):
        raise SystemExit("error: authors: those of pyproject.toml and CITATION.cff differ")
    return project, citation


def names(authors: list[dict[str, str]]) -> list[str]:
    """One text for each author: a person by family name and given names, or an entity by its name."""
    return [
        one["name"] if "name" in one else f"{one['family-names']}, {one['given-names']}"
        for one in authors
    ]  # fmt: skip


def codemeta(project: dict[str, Any], citation: dict[str, Any]) -> dict[str, Any]:
    """CodeMeta 3.0."""
    (report,) = citation["references"]
    return {
        "@context": "https://w3id.org/codemeta/3.0",
        "type": "SoftwareSourceCode",
        "name": project["name"],
        "description": project["description"],
        "version": project["version"],
        "dateModified": f"{citation['date-released']}",
        "license": f"https://spdx.org/licenses/{project['license']}",
        "author": [author(one) for one in citation["authors"]],
        "keywords": project["keywords"],
        "programmingLanguage": ["Python", "C"],
        "runtimePlatform": f"Python {project['requires-python']}",
        "operatingSystem": ["Linux", "macOS"],
        "developmentStatus": "active",
        "softwareRequirements": [re.split(r"[ ;]", line)[0] for line in project["dependencies"]],
        "referencePublication": {
            "type": "Report",
            "name": report["title"],
            "reportNumber": report["number"],
            "datePublished": f"{report['year']}-{report['month']}",
            "publisher": {"type": "Organization", "name": report["institution"]["name"]},
        },
    }


def author(one: dict[str, str]) -> dict[str, str]:
    """An author of CITATION.cff as CodeMeta has it."""
    if "name" in one:
        return {"type": "Organization", "name": one["name"]}
    person = {"type": "Person", "givenName": one["given-names"], "familyName": one["family-names"]}
    return {**person, **({"id": one["orcid"]} if "orcid" in one else {})}


def zenodo(project: dict[str, Any], citation: dict[str, Any]) -> dict[str, Any]:
    """What Zenodo shows of an archived release."""
    (report,) = citation["references"]
    creators = [
        {"name": name, **({"orcid": one["orcid"].rsplit("/", 1)[-1]} if "orcid" in one else {})}
        for name, one in zip(names(citation["authors"]), citation["authors"], strict=True)
    ]
    return {
        "title": citation["title"],
        "description": project["description"],
        "upload_type": "software",
        "version": project["version"],
        "access_right": "open",
        "license": project["license"],
        "creators": creators,
        "keywords": project["keywords"],
        "references": [f"{report['title']}. {report['number']}, {report['institution']['name']}, {report['year']}."],
    }


def texts() -> dict[str, str]:
    """Name of each file, and what it contains."""
    given = sources()
    files = {"codemeta.json": codemeta(*given), ".zenodo.json": zenodo(*given)}
    return {name: json.dumps(content, indent=2, ensure_ascii=False) + "\n" for name, content in files.items()}


def main() -> None:
    for name, text in texts().items():
        (docs_folder().parent / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    parser(__doc__).parse_args()
    main()
