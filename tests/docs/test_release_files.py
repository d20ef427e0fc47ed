"""What a release is made of: metadata, workflows, forms for issues, and the paper."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import check_release
import make_metadata
import pytest
import yaml
from support import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
FORMS = sorted(path for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if path.stem != "config")
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
BODY = PAPER.split("---\n", 2)[2]
# What the paper says -> the page that measured it, and the words there.
FIGURES = {
    "takes 1.01 times": ("performance", "(11,5,5): (5,2,2) | 9.18 s | 9.06 s | 1.01 times"),
    "takes 1.6 us, 2.3 times less": ("performance", "| 1598 ns | 3668 ns;"),
    "25 times faster: 4.1 ms against 104 ms": (
        "performance",
        "| 4.12 ms at 0.01, error 1.0e-03 | `TripleFrictionPendulum` 104.2 ms",
    ),
    "33 ms at a tolerance of 3e-2, with a force error of 0.24 %": ("performance", "| 33.4 ms at 0.03, error 2.4e-03"),
    "in 30 cases": ("verification", "30 cases contain every value of every effect"),
    "within 0.2 of theory": ("verification", "Observed orders are within 0.2 of it"),
    "1828 comparisons": ("validation", "1828 comparisons"),
    "1767 of them": ("validation", "1767 of them within the tolerance"),
    "hundreds to thousands of hertz": ("glossary", "at hundreds to thousands of hertz"),
}


def flat(text: str) -> str:
    return " ".join(text.split())


# ---- metadata ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["codemeta.json", ".zenodo.json"])
def test_metadata_is_that_of_the_project_file_and_the_citation(name: str) -> None:
    assert (ROOT / name).read_text(encoding="utf-8") == make_metadata.texts()[name], "run docs/make_metadata.py"


def test_metadata_agrees_everywhere() -> None:
    project, citation = make_metadata.sources()
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    archive = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    assert meta["version"] == archive["version"] == project["version"] == citation["version"]
    assert meta["license"].endswith(f"/{project['license']}") and archive["license"] == project["license"]
    assert [one["name"] for one in archive["creators"]] == make_metadata.names(project["authors"])
    paper = yaml.safe_load(PAPER.split("---\n", 2)[1])
    assert paper["title"] == citation["title"] == archive["title"]
    assert [one["name"] for one in paper["authors"]] == make_metadata.names(citation["authors"])


def test_a_disagreement_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("pyproject.toml", "CITATION.cff"):
        (tmp_path / name).write_text((ROOT / name).read_text(encoding="utf-8"), encoding="utf-8")
    citation = tmp_path / "CITATION.cff"
    citation.write_text(re.sub(r"version: \d.*", "version: 9.9.9", citation.read_text("utf-8")), encoding="utf-8")
    monkeypatch.setattr(make_metadata, "ROOT", tmp_path)
    with pytest.raises(SystemExit, match=r"version: .* in pyproject\.toml, '9\.9\.9' in CITATION\.cff"):
        make_metadata.sources()


def test_persons_are_authors_with_their_names() -> None:
    person = {"family-names": "Doe", "given-names": "Jane", "orcid": "https://orcid.org/0000-0002-1825-0097"}
    citation = {**make_metadata.sources()[1], "authors": [person]}
    project = make_metadata.sources()[0]
    assert make_metadata.codemeta(project, citation)["author"][0]["familyName"] == "Doe"
    assert make_metadata.zenodo(project, citation)["creators"] == [
        {"name": "Doe, Jane", "orcid": "0000-0002-1825-0097"}
    ]


# ---- a release ---------------------------------------------------------------------------------------------------


def released(root: Path, version: str, **changed: str) -> Path:
    """Files that say `version`, but for those in `changed`."""
    texts = {
        "pyproject.toml": f'[project]\nversion = "{version}"\n',
        "CITATION.cff": f"version: {version}\ndate-released: 2026-12-01\n",
        "CHANGELOG.md": f"# Changelog\n\n## {version} (2026-12-01)\n\n## 0.1.0 (2026-11-21)\n",
        "benchmarks/results/validation.csv": f"version,date\n{version},2026-12-01\n",
    }
    for name, text in {**texts, **changed}.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


def test_files_of_a_release_fit(tmp_path: Path) -> None:
    assert check_release.problems("0.3.0", released(tmp_path, "0.3.0")) == []
    assert check_release.problems("0.3.0rc1", released(tmp_path, "0.3.0rc1")) == []


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("pyproject.toml", '[project]\nversion = "0.2.0"\n', "pyproject.toml: version is 0.2.0, not 0.3.0"),
        ("CITATION.cff", "version: 0.2.0\ndate-released: 2026-12-01\n", "CITATION.cff: version is 0.2.0"),
        ("CITATION.cff", "version: 0.3.0\ndate-released: 2026-11-01\n", "date-released is not 2026-12-01"),
        ("CHANGELOG.md", "# Changelog\n\n## Unreleased\n", "the first heading is 'Unreleased'"),
        ("benchmarks/results/validation.csv", "version,date\n0.2.0,2026-11-26\n", "no row for 0.3.0"),
    ],
)
def test_what_does_not_fit_a_release_is_named(name: str, text: str, message: str, tmp_path: Path) -> None:
    (line,) = check_release.problems("0.3.0", released(tmp_path, "0.3.0", **{name: text}))
    assert message in line


@pytest.mark.parametrize("version", ["v0.3.0", "0.3", "", "0.3.0; rm -rf ~"])
def test_a_version_has_a_form(version: str, tmp_path: Path) -> None:
    (line,) = check_release.problems(version, released(tmp_path, "0.3.0"))
    assert "is not of the form" in line


def test_the_check_of_a_release_fails_with_code_2() -> None:
    command = [sys.executable, str(ROOT / "tools" / "check_release.py"), "99.0.0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "pyproject.toml: version is" in done.stderr


# ---- workflows and forms -----------------------------------------------------------------------------------------


def commands(path: Path) -> list[str]:
    """Every line that a workflow of GitHub or GitLab runs."""
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    if path.name == ".gitlab-ci.yml":
        return [line for job in content.values() for line in job["script"]]
    steps = [step for job in content["jobs"].values() for step in job["steps"]]
    return [line for step in steps if "run" in step for line in step["run"].splitlines()]


@pytest.mark.parametrize("path", [*WORKFLOWS, ROOT / ".gitlab-ci.yml"], ids=lambda path: path.name)
def test_workflows_run_what_exists(path: Path) -> None:
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    lines = commands(path)
    assert lines
    for line in lines:
        program, *words = line.split()
        if program == "make":
            assert set(words) <= targets, line
        elif program in ("python", "python3") and words[0] != "-m":
            assert (ROOT / words[0]).is_file(), line
        elif "/" in program and not program.startswith(".venv/"):
            assert (ROOT / program).is_file(), line


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_take_no_text_of_a_person_into_a_shell(path: Path) -> None:
    """An expression in a command is pasted before the shell reads it; inputs reach commands as variables."""
    assert not [line for line in commands(path) if "${{" in line]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_actions_are_pinned_to_commits(path: Path) -> None:
    """With the version beside, since a tag may move to other code."""
    used = re.findall(r"uses: (.+)", path.read_text(encoding="utf-8"))
    assert used and all(re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", one) for one in used)


def test_a_release_is_started_by_a_person_and_needs_no_token() -> None:
    path = ROOT / ".github" / "workflows" / "release.yml"
    workflow: dict[Any, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert list(workflow[True]) == ["workflow_dispatch"]  # YAML 1.1 reads the key "on" as true
    jobs = workflow["jobs"]
    assert workflow["permissions"] == {"contents": "read"}
    assert jobs["publish"]["permissions"] == {"id-token": "write"} and jobs["publish"]["environment"]
    assert "permissions" not in jobs["build"] and jobs["publish"]["needs"] == "build"
    assert "secrets." not in path.read_text(encoding="utf-8")
    lines = commands(path)
    assert lines.index('python tools/check_release.py "$VERSION"') < lines.index("make package")


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.name)
def test_forms_for_issues_are_forms(path: Path) -> None:
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert form["name"] and form["description"] and form["body"]
    fields = [part for part in form["body"] if part["type"] != "markdown"]
    assert len({part["id"] for part in fields}) == len(fields)
    assert all(part["attributes"]["label"] for part in fields)
    assert any(part.get("validations", {}).get("required") for part in fields)


def test_a_bug_comes_with_its_scene_and_its_machine() -> None:
    form = yaml.safe_load((ROOT / ".github" / "ISSUE_TEMPLATE" / "bug.yml").read_text(encoding="utf-8"))
    required = {part["id"] for part in form["body"] if part.get("validations", {}).get("required")}
    assert {"happened", "scene", "doctor"} <= required


# ---- the paper ---------------------------------------------------------------------------------------------------


def test_the_paper_has_the_sections_that_the_journal_asks() -> None:
    sections = re.findall(r"^# (.+)$", BODY, re.MULTILINE)
    wanted = ["Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"]
    assert sections[:5] == wanted and sections[-1] == "References" and "AI usage disclosure" in sections


def test_the_paper_cites_what_the_bibliography_has() -> None:
    text = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")
    entries = dict(re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", text, re.MULTILINE | re.DOTALL))
    assert set(re.findall(r"@(\w+)", BODY)) == set(entries)
    for name, entry in entries.items():
        assert re.search(r"doi +=|url +=|institution +=", entry), name
        assert all(re.fullmatch(r"10\.\d{4,}/\S+", doi) for doi in re.findall(r"doi += \{(.+)\}", entry)), name


def test_figures_of_the_paper_exist() -> None:
    pictures = re.findall(r"!\[[^]]*\\label\{[\w:]+\}\]\((.+?)\)", BODY)
    assert len(pictures) == 2 and all((ROOT / "paper" / path).is_file() for path in pictures)


def test_numbers_of_the_paper_are_those_of_the_pages() -> None:
    for claim in FIGURES:
        page, words = FIGURES[claim]
        assert claim in flat(PAPER)
        assert words in flat((ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8"))


# ---- other pages -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ROADMAP.md", "SECURITY.md", "CODE_OF_CONDUCT.md"])
def test_links_of_the_pages_beside_the_readme_lead_somewhere(name: str) -> None:
    links = re.findall(r"\]\((?!https:)([^)#]+)", (ROOT / name).read_text(encoding="utf-8"))
    assert not [link for link in links if not (ROOT / link).exists()]
