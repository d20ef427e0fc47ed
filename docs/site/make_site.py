"""Builds the documentation site: `python docs/site/make_site.py [-o FOLDER] [--no-gallery]`. Needs the extra "docs".

The pages of docs/ stay as they are: they are copied to a folder of sources beside the pages of docs/site/, with what
they link to, and Sphinx runs there with warnings as errors. The site needs no network.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory

SITE = Path(__file__).resolve().parent
ROOT = SITE.parents[1]
# Pages outside docs/, and files that pages link to.
PAGES = (
    "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ROADMAP.md", "SECURITY.md", "CODE_OF_CONDUCT.md",
    "benchmarks/README.md",
)  # fmt: skip
FILES = ("LICENSE", "CITATION.cff", "examples", "docs/figures", ".github/workflows")
SOURCES = r"\]\(\.\./((?:generator|msfp_gen)/[^)#]+)\)"  # links of pages to the code
# A link to a folder or to an example leads to the gallery, where there is one.
GALLERY_LINKS = {"](examples)": "](gallery/index)", "](../examples)": "](../gallery/index)"}
NO_GALLERY_LINKS = {"](examples)": "](index.md)", "](../examples)": "](../index.md)"}


def main() -> None:
    """Write the site into the folder of -o."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "docs")
    parser.add_argument("--no-gallery", action="store_true", help="leave out the examples, which are run otherwise")
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
    links = GALLERY_LINKS if gallery else NO_GALLERY_LINKS
    for path in (*(ROOT / name for name in PAGES), *sorted((ROOT / "docs").glob("*.md"))):
        text = path.read_text(encoding="utf-8")
        for old, new in links.items():
            text = text.replace(old, new)
        target = source / path.relative_to(ROOT)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
    linked = {
        name for path in (ROOT / "docs").glob("*.md") for name in re.findall(SOURCES, path.read_text(encoding="utf-8"))
    }
    for name in (*FILES, *sorted(linked)):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copyfile)(ROOT / name, source / name)
    (source / "cli.md").write_text(command_page(), encoding="utf-8")
    if gallery:
        write_gallery(source / "gallery_scripts")
        return
    for name in ("tutorials.md", "buildings.md"):
        page = source / name
        lines = [line for line in page.read_text(encoding="utf-8").splitlines() if "gallery/" not in line]
        page.write_text("\n".join(lines) + "\n", encoding="utf-8")


def command_page() -> str:
    """Help texts of all commands."""
    parts = ["# Commands\n\nThe help text of every command, as `msfp-gen COMMAND --help` prints it.\n"]
    listing = help_of()
    names = [line.split()[0] for line in listing.partition("Commands:\n")[2].partition("\n\n")[0].splitlines()
             if line.startswith("  ") and line[2] != " "]  # fmt: skip
    for name in ("", *names):
        text = listing if not name else help_of(name)
        parts.append(f"## {f'msfp-gen {name}'.strip()}\n\n```text\n{text.strip()}\n```\n")
    return "\n".join(parts)


def help_of(*command: str) -> str:
    """Help text of a command, 100 columns wide."""
    environment = {**os.environ, "COLUMNS": "100", "NO_COLOR": "1"}
    run = [sys.executable, "-m", "msfp_gen", *command, "--help"]
    return subprocess.run(run, cwd=ROOT, env=environment, text=True, capture_output=True, check=True).stdout


def write_gallery(folder: Path) -> None:
    """A script for every scene, notebook, library and script with cells in examples/, for sphinx-gallery to run."""
    folder.mkdir()
    title = "Examples"
    (folder / "GALLERY_HEADER.rst").write_text(
        f"{title}\n{'=' * len(title)}\n\nThe scenes, notebooks and programs in `examples/`, run.\n"
    )
    (folder / "examples").mkdir()  # sphinx-gallery runs a script where it lies
    for path in (*sorted((ROOT / "examples").glob("*.toml")), ROOT / "examples" / "building" / "building.toml"):
        (folder / path.relative_to(ROOT)).parent.mkdir(exist_ok=True)
        shutil.copy(path, folder / path.relative_to(ROOT))
        (folder / f"plot_{path.stem}.py").write_text(scene_script(path), encoding="utf-8")
    for name in ("pareto", "sobol"):
        shutil.copy(ROOT / "examples" / "libraries" / f"{name}.py", folder / f"plot_{name}.py")
    for path in sorted((ROOT / "examples").glob("*.ipynb")):
        (folder / f"plot_{path.stem}.py").write_text(notebook_script(path), encoding="utf-8")
    for path in sorted((ROOT / "examples").glob("*.py")):
        if "# %%" in path.read_text(encoding="utf-8"):
            shutil.copy(path, folder / f"plot_{path.name}")


def scene_script(path: Path) -> str:
    """A script that runs a scene file; its text is the comment at the head of the file."""
    text = path.read_text(encoding="utf-8")
    building = "building" in tomllib.loads(text)
    about = [line.lstrip("# ").rstrip() for line in text.partition("\n\n")[0].splitlines()]
    command = next(line for line in about if line.startswith("msfp-gen "))
    words = " ".join(line for line in about if line != command)
    title = f"{about[0].partition(':')[0].removesuffix('.')} ({path.name})"
    return (BUILDING_SCRIPT if building else BEARING_SCRIPT).format(
        title=title, line="=" * len(title), words=words, command=command, name=path.relative_to(ROOT / "examples")
    )


HEAD = '''"""
{title}
{line}

{words}

.. code-block:: sh

   {command}

The same from Python:
"""

from msfp_gen import load_scene, simulate
'''
BEARING_SCRIPT = (
    HEAD
    + """from msfp_gen.figures import plot_result, plot_section

result = simulate(load_scene("examples/{name}"))
figure = plot_result(result)

# %%
# The stack at its largest displacement:

figure = plot_section(result)

# %%
# What it reached:

summary = result.summary
print("peak displacement [mm]", round(1e3 * summary["peak_displacement"]["radial"], 1))
print("peak force over load", round(summary["peak_force_ratio"], 4))
print("rims met", summary["rims_met"])
"""
)
BUILDING_SCRIPT = (
    HEAD
    + """from msfp_gen.buildings.figures import plot_axial_forces, plot_building

result = simulate(load_scene("examples/{name}"))
figure = plot_building(result)

# %%
# The axial force of every bearing:

figure = plot_axial_forces(result)

# %%
# What it reached:

summary = result.summary
print("peak displacement [mm]", round(1e3 * summary["peak_displacement"]["radial"], 1))
print("base shear over weight", round(summary["peak_force_ratio"], 3))
print("drift at corners [%]", round(100 * summary["peak_corner_drift_ratio"], 3))
"""
)


def notebook_script(path: Path) -> str:
    """The cells of a notebook as a script."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    parts: list[str] = []
    for number, cell in enumerate(cells):
        text = "".join(cell["source"])
        if cell["cell_type"] == "code":
            parts += [*(["# %%"] if cells[number - 1]["cell_type"] == "code" else []), text.rstrip(";")]
            continue
        text = "\n".join(rst_heading(line) for line in text.splitlines()).replace("`", "``")
        block = "\n".join(f"# {line}".rstrip() for line in text.splitlines())
        parts.append(f'"""\n{text}\n"""' if number == 0 else f"# %%\n{block}")
    return "\n\n".join(parts) + "\n"


def rst_heading(line: str) -> str:
    """A heading of Markdown as one of reStructuredText; other lines stay."""
    level = len(line) - len(line.lstrip("#"))
    if not level or not line[level:].startswith(" "):
        return line
    title = line[level:].strip()
    return f"{title}\n{'=-'[level - 1] * len(title)}"


if __name__ == "__main__":
    main()
