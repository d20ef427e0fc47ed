"""The documentation site: every page has its place, and it is built without a warning and without the network."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType

import pytest
from support import ROOT

SITE = ROOT / "docs" / "site"
EXAMPLES = ROOT / "examples" / "gallery"
NEEDED = ("sphinx", "myst_parser", "pydata_sphinx_theme", "sphinx_gallery", "latex2mathml")
MISSING = [name for name in NEEDED if importlib.util.find_spec(name) is None]
needs_sphinx = pytest.mark.skipif(bool(MISSING), reason=f"the extra 'docs' is not installed ({', '.join(MISSING)})")


def tree() -> list[str]:
    """Documents that the section pages list, as they are named there."""
    found = []
    for page in sorted(SITE.rglob("*.md")):
        for block in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            lines = [line.strip() for line in block.splitlines() if line.strip() and not line.startswith(":")]
            folder = page.parent.relative_to(SITE).as_posix()
            names = [re.sub(r".*<(.*)>", r"\1", line) for line in lines]
            found += names if folder == "." else [f"{folder}/{name}" for name in names]
    return found


def test_every_page_stands_in_one_section() -> None:
    listed = tree()
    pages = {f"docs/{path.stem}" for path in ROOT.glob("docs/*.md")}
    assert {name for name in listed if name.startswith("docs/")} == pages
    assert len(listed) == len(set(listed))


def test_the_python_interface_is_complete() -> None:
    import msfp_gen

    page = "".join(path.read_text(encoding="utf-8") for path in sorted((SITE / "api").glob("*.md")))
    named = set(re.findall(r"auto(?:class|function|exception):: (\w+)$", page, re.MULTILINE))
    assert named == set(msfp_gen.__all__) - {"__version__", "presets"}
    assert "msfp_gen.scene.file.presets" in page


class Loaded(HTMLParser):
    """Addresses that a page loads by itself: scripts, styles, pictures, frames."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        name = {"script": "src", "img": "src", "iframe": "src", "source": "src", "link": "href"}.get(tag)
        if name and given.get(name) and given.get("rel") not in ("canonical", "index", "search", "next", "prev"):
            self.found.append(str(given[name]))


def check_site(folder: Path) -> None:
    pages = [path for path in sorted(folder.rglob("*.html")) if "_static" not in path.parts]  # templates of the theme
    assert {f"{name}.html" for name in tree() if "gallery" not in name} <= {
        path.relative_to(folder).as_posix() for path in pages
    }
    for path in pages:
        loaded = Loaded()
        loaded.feed(path.read_text(encoding="utf-8"))
        for address in loaded.found:
            assert not re.match(r"(https?:)?//", address), f"{path.name} loads {address}"
            if not address.startswith("data:"):
                assert (path.parent / re.sub(r"[?#].*", "", address)).exists(), f"{path.name}: {address}"
    for style in folder.rglob("*.css"):
        assert not re.search(r"(@import|url\()\s*['\"]?(https?:)?//", style.read_text(encoding="utf-8")), style.name
    for page, names in {"running": ("simulate", "load_scene"), "scenes": ("Bearing",), "errors": ("RunError",)}.items():
        api = (folder / "api" / f"{page}.html").read_text(encoding="utf-8")
        assert all(f'id="msfp_gen.{name}"' in api for name in names)
    texts = (folder / "_static" / "search_texts.js").read_text(encoding="utf-8")
    assert "Friction pendulum bearings isolate buildings from earthquakes" in texts and '"docs/buildings"' in texts
    users = [path.name for path in pages if "search_texts.js" in path.read_text(encoding="utf-8")]
    assert users == ["search.html"], "only the search loads the texts of all pages"
    assert "msfp-gen explain" in (folder / "cli.html").read_text(encoding="utf-8")
    model = (folder / "docs" / "model.html").read_text(encoding="utf-8")
    assert "On this page" in model, "a long page lists its sections"
    assert "<math" in model
    for path in pages:
        article = path.read_text(encoding="utf-8").partition("<article")[2].partition("</article")[0]
        assert "$" not in re.sub(r"<(code|pre).*?</\1>", "", article, flags=re.DOTALL), f"{path.name}: a raw formula"
        assert "flowchart TB" not in article, f"{path.name}: a raw diagram"
        if path.parent.name == "api":
            assert not re.search(r"Annotated|_NestedSequence|ForwardRef|&lt;lambda", article), (
                f"{path.name}: a raw type"
            )


def build(folder: Path, *options: str) -> None:
    command = [sys.executable, str(SITE / "make_site.py"), "-o", str(folder), *options]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert not run.stderr.replace("Process 0 Terminating\n", ""), run.stderr  # what OpenSees says at its end


def site_module(monkeypatch: pytest.MonkeyPatch, name: str) -> ModuleType:
    monkeypatch.syspath_prepend(SITE)
    return importlib.import_module(name)


def test_an_example_without_its_library_is_left_out_with_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_site = site_module(monkeypatch, "make_site")
    programs = shutil.copytree(EXAMPLES / "programs", tmp_path / "programs")
    monkeypatch.setattr(make_site, "find_spec", lambda name: None if name == "openseespy" else importlib.util)
    make_site.leave_out(tmp_path)
    assert {path.name for path in programs.iterdir()} == {"GALLERY_HEADER.rst", "audit.py"}
    header = (programs / "GALLERY_HEADER.rst").read_text(encoding="utf-8")
    assert header.endswith("\n`opensees.py` is left out here: it needs `openseespy`, which is not installed.\n")


@needs_sphinx
def test_every_example_has_a_place_in_its_section(monkeypatch: pytest.MonkeyPatch) -> None:
    order = site_module(monkeypatch, "gallery_settings").ORDER
    assert len(order) == len(set(order)) and set(order) == {path.stem for path in EXAMPLES.rglob("*.py")}
    titles = [path.read_text(encoding="utf-8")[3:].splitlines()[:2] for path in EXAMPLES.rglob("*.py")]
    assert all(len(title) == len(line) <= 62 and set(line) == {"="} for title, line in titles)


@pytest.mark.slow
def test_report_of_the_hospital_page_is_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_site = site_module(monkeypatch, "make_site")
    assert make_site.REPORT in (ROOT / "docs" / "hospital.md").read_text(encoding="utf-8")
    assert 'href="../_static/report.html"' in make_site.report(tmp_path)
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "All 6 runs reached their end" in html and str(ROOT) not in html
    titles = re.findall(r"<h2 [^>]*>\d+\. (.*?)</h2>", html)
    assert {"Bearing", "Superstructure", "Floor spectra", "Uplift", "Loops", "Energy and numerical error"} <= set(
        titles
    )


@pytest.mark.slow
@needs_sphinx
def test_site_is_built_without_a_warning(tmp_path: Path) -> None:
    build(tmp_path / "site", "--no-gallery")
    check_site(tmp_path / "site")
    assert "_static/report.html" not in (tmp_path / "site" / "docs" / "hospital.html").read_text(encoding="utf-8")


@needs_sphinx
@pytest.mark.slow
def test_gallery_runs_every_example_and_the_explorer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(tmp_path / "site")
    check_site(tmp_path / "site")
    bearing = (tmp_path / "site" / "docs" / "bearing.html").read_text(encoding="utf-8")
    assert ('<iframe class="explorer"' in bearing) == (importlib.util.find_spec("ziglang") is not None)
    hospital = (tmp_path / "site" / "docs" / "hospital.html").read_text(encoding="utf-8")
    assert 'href="../_static/report.html"' in hospital and (tmp_path / "site" / "_static" / "report.html").is_file()
    kept = shutil.copytree(EXAMPLES, tmp_path / "kept")
    site_module(monkeypatch, "make_site").leave_out(kept)
    examples = {path.relative_to(kept).with_suffix("") for path in kept.rglob("*.py")}
    pages = tmp_path / "site" / "gallery"
    shown = {path.relative_to(pages).with_suffix("") for path in pages.rglob("*.html") if path.stem != "index"}
    assert shown == examples
    for example in examples:
        page = (pages / example).with_suffix(".html").read_text(encoding="utf-8")
        assert f"_images/sphx_glr_{example.name}_001.png" in page, f"{example} has no figure"
        assert str(ROOT) not in page, "a path of this machine"
        assert "[Text(" not in page, "what a function of pyplot returns"
        assert f"{example.name}.ipynb" in page and f"{example.name}.py" in page
