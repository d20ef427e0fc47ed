"""What the README and the page of commands and Python show works as shown."""

import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from support import ROOT

from msfp_gen import load_scene
from msfp_gen.cli import main

README, COMMANDS = ((ROOT / name).read_text(encoding="utf-8") for name in ("README.md", "docs/commands.md"))


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", README + COMMANDS, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("code", blocks("python"), ids=lambda code: code.splitlines()[0][:60])
def test_python_runs(code, tmp_path):
    command = [sys.executable, "-W", "error", "-c", code]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()


def test_there_is_python_to_run():
    assert blocks("python") and blocks("toml")


def test_scene_file_loads_and_runs(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(blocks("toml")[0], encoding="utf-8")
    scene = load_scene(path)
    assert scene.top.axial_load == 112e3 and scene.top.stiffness == pytest.approx(1e8) and scene.end == 10.0
    command = next(line for line in README.splitlines() if line.startswith("msfp-gen run scene.toml"))
    arguments = [str(tmp_path / a) if Path(a).suffix in (".toml", ".nc", ".png") else a for a in command.split()[1:]]
    assert main(arguments) == 0
    assert {p.name for p in tmp_path.iterdir()} == {"scene.toml", "result.nc", "loops.png"}
    capsys.readouterr()


def test_every_command_is_listed(capsys):
    main(["--help"])
    listed = re.search(r"^Commands:\n(.*?)\n\n", capsys.readouterr().out, flags=re.MULTILINE | re.DOTALL)
    names = {line.split()[0] for line in listed[1].splitlines() if line.startswith("  ") and line[2] != " "}
    assert names == set(re.findall(r"^\| `msfp-gen (\w+)", COMMANDS, flags=re.MULTILINE))


@cache
def anchors(page):
    """What links to the headings of a page may name, as GitHub and the site do."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    titles = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title) for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE))
    return {re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def test_every_page_is_linked_and_every_link_leads_somewhere():
    for page in (
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/*.md"),
        *ROOT.glob("benchmarks/*.md"),
        *ROOT.glob("docs/site/*.md"),
    ):
        folder = ROOT if page.parent.name == "site" else page.parent  # the site is put together at the root
        for link, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text(encoding="utf-8")):
            if link.startswith(("http", "gallery/", "api/")):
                continue
            target = (folder / link).resolve() if link else page
            assert target.exists(), f"{page.name}: {link}"
            assert not anchor or anchor in anchors(target), f"{page.name}: {link}#{anchor}"
    linked = set(re.findall(r"\(docs/([\w-]+)\.md", README))
    assert linked == {page.stem for page in ROOT.glob("docs/*.md")}


def test_make_targets_exist():
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    pages = README + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    wanted = set(re.findall(r"`make (\w+)`", pages))
    assert wanted and wanted <= targets


def test_citation_names_the_version_that_is_built():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    released = re.search(r"^date-released: (\S+)$", citation, flags=re.MULTILINE)
    assert f"\nversion: {version}\n" in citation and released is not None
    assert f"## {version} ({released[1]})\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
