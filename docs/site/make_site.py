"""Builds the documentation site: `python docs/site/make_site.py [-o FOLDER] [--no-gallery]`. Needs the extra "docs".

The pages of docs/ stay as they are: they are copied to a folder of sources beside the pages of docs/site/, with what
they link to, and Sphinx runs there with warnings as errors. The site needs no network.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]
# Pages outside docs/, and files that pages link to.
PAGES = (
    "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ROADMAP.md", "SECURITY.md", "CODE_OF_CONDUCT.md",
    "benchmarks/README.md", "benchmarks/isolation/README.md",
)  # fmt: skip
FILES = ("LICENSE", "CITATION.cff", "examples", "docs/figures", "benchmarks/isolation", ".github/workflows")
SOURCES = r"\]\(\.\./((?:generator|msfp_gen)/[^)#]+)\)"  # links of pages to the code
EXPLORER = "<!-- explorer -->\n"  # where it stands on the page of the bearing
REPORT = "<!-- report -->\n"  # where the page of the hospital leads to a report
DIAGRAM = r"```mermaid\nflowchart TB\n([^`]*)```\n"
EXAMPLES = r"\]\(((?:\.\./)?)examples(?:/gallery/(\w+/\w+)\.py)?\)"  # links to the examples, or to one of the gallery


def main() -> None:
    """Write the site into the folder of -o."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "docs")
    parser.add_argument(
        "--no-gallery", action="store_true", help="leave out examples, explorer and report, which run code otherwise"
    )
    given = parser.parse_args()
    with TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        collect(source, gallery=not given.no_gallery)
        target = Path(folder) / "html"
        environment = {**os.environ, "MSFP_GEN_SITE_GALLERY": str(int(not given.no_gallery))}
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", str(source), str(target)]
        if code := subprocess.run(command, env=environment).returncode:
            raise SystemExit(code)
        shutil.rmtree(target / ".doctrees", ignore_errors=True)
        # Only a complete site replaces the previous one.
        shutil.rmtree(given.output, ignore_errors=True)
        given.output.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(target, given.output)
    print(f"wrote {given.output / 'index.html'}")


def collect(source: Path, *, gallery: bool) -> None:
    """Copy all sources of the site to a new folder."""
    shutil.copytree(SITE, source, ignore=shutil.ignore_patterns("make_site.py", "__pycache__"))
    linked = {
        name for path in (ROOT / "docs").glob("*.md") for name in re.findall(SOURCES, path.read_text(encoding="utf-8"))
    }
    for name in (*FILES, *sorted(linked)):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copyfile)(ROOT / name, source / name)
    if gallery:
        leave_out(source / "examples" / "gallery")
    live = gallery and find_spec("ziglang") is not None

    def target(link: re.Match[str]) -> str:
        """A link to the examples leads to their gallery, where there is one."""
        if not gallery:
            return link[0] if link[2] else f"]({link[1]}index.md)"
        shown = link[2] and (source / "examples" / "gallery" / f"{link[2]}.py").exists()
        return f"]({link[1]}gallery/{link[2] if shown else 'index'}.rst)"

    for path in (*(ROOT / name for name in PAGES), *sorted((ROOT / "docs").glob("*.md"))):
        page = source / path.relative_to(ROOT)
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(re.sub(EXAMPLES, target, path.read_text(encoding="utf-8")), encoding="utf-8")
    page = source / "docs" / "bearing.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace(EXPLORER, explorer(text, source / "_static") if live else ""), encoding="utf-8")
    page = source / "docs" / "hospital.md"
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace(REPORT, report(source / "_static") if gallery else ""), encoding="utf-8")
    page = source / "docs" / "architecture.md"
    page.write_text(re.sub(DIAGRAM, arrows, page.read_text(encoding="utf-8")), encoding="utf-8")
    (source / "cli.md").write_text(command_page(), encoding="utf-8")
    for name in () if gallery else ("start.md", "buildings.md"):
        page = source / name
        lines = [line for line in page.read_text(encoding="utf-8").splitlines() if "gallery/" not in line]
        page.write_text("\n".join(lines) + "\n", encoding="utf-8")


def arrows(diagram: re.Match[str]) -> str:
    """A diagram as a table, since drawing it needs a script from the network."""
    rows = ["| from | arrow | to |", "|---|---|---|"]
    for line in diagram[1].splitlines():
        begin, arrow, ends = re.fullmatch(r'\s*(\w+) -(?:->|\. (\w+) \.->) (.+?)(?:\["[^]]*)?\]?', line).groups()
        rows.append(f"| `{begin}` | {arrow or 'imports'} | {', '.join(f'`{end}`' for end in ends.split(' & '))} |")
    return "\n".join(rows) + "\n"


def explorer(page: str, folder: Path) -> str:
    """Write the explorer of the first data sheet of a page into a folder; returns what the page shows of it."""
    sheet = page.partition("```toml\n")[2].partition("```")[0]
    with TemporaryDirectory() as name:
        scene = Path(name) / "scene.toml"
        scene.write_text((SITE / "explorer.toml").read_text(encoding="utf-8") + sheet, encoding="utf-8")
        program("explore", scene, "-o", folder / "explorer.html")
    return (
        "Move a control, and this bearing runs again in your browser ([explorer](figures.md#the-explorer)):\n\n"
        '<iframe class="explorer" src="../_static/explorer.html" title="Explorer of this bearing" loading="lazy">'
        "</iframe>\n"
    )


def report(folder: Path) -> str:
    """Write the report of a suite of two short records into a folder; returns what the page of the hospital says."""
    with TemporaryDirectory() as name:
        runs = Path(name) / "analysis"
        program("bound", SITE / "two-storeys.toml", "--suite", SITE / "two-records.toml", "-o", runs)
        program("report", runs, "-o", folder / "report.html", "--project", "Building of the documentation",
                "--author", "an engineer", "--checker", "another engineer")  # fmt: skip
    return (
        '<a href="../_static/report.html">The report of a suite of two short records</a>, on a smaller building, shows '
        "what the last command writes.\n\n"
    )


def program(*words: object) -> None:
    """Run a command of msfp-gen. Raises SystemExit with its message where it fails."""
    command = [sys.executable, "-m", "msfp_gen", *map(str, words)]
    if (done := subprocess.run(command, cwd=ROOT, text=True, capture_output=True)).returncode:
        raise SystemExit(done.stderr)


def command_page() -> str:
    """Help texts of all commands."""
    who = "For everyone who works in a terminal: the help of every command, as `msfp-gen COMMAND --help` prints it."
    parts = [f"# Commands\n\n{who}\n"]
    listing = help_of()
    names = [line.split()[0] for line in listing.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
             if line.startswith("  ") and line[2] != " "]  # fmt: skip
    for name in ("", *names):
        text = listing if not name else help_of(name)
        parts.append(f"## {f'msfp-gen {name}'.strip()}\n\n```text\n{text.strip()}\n```\n")
    return "\n".join(parts)


def help_of(*command: str) -> str:
    """Help text of a command, 120 columns wide."""
    environment = {**os.environ, "COLUMNS": "120", "NO_COLOR": "1"}
    run = [sys.executable, "-m", "msfp_gen", *command, "--help"]
    return subprocess.run(run, cwd=ROOT, env=environment, text=True, capture_output=True, check=True).stdout


def leave_out(gallery: Path) -> None:
    """Remove the examples of libraries that are not installed, with a sentence in their section."""
    for path in sorted(gallery.rglob("*.py")):
        imported = re.findall(r"^(?:from|import) (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
        for library in sorted(name for name in set(imported) if find_spec(name) is None):
            path.unlink(missing_ok=True)
            with (path.parent / "GALLERY_HEADER.rst").open("a", encoding="utf-8") as header:
                header.write(f"\n`{path.name}` is left out here: it needs `{library}`, which is not installed.\n")


if __name__ == "__main__":
    main()
