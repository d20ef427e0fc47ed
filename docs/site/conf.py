"""Sphinx configuration of the documentation site; `make_site.py` puts its sources together and runs it."""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.highlighting import lexers
from sphinx.util.inspect import TypeAliasForwardRef

from msfp_gen.common.version import __version__

project = "msfp-gen"
author = "The msfp-gen developers"
copyright = author
version = release = __version__

sys.path.insert(0, str(Path(__file__).parent))  # gallery_settings, excerpts, terms
import excerpts  # noqa: E402
import terms  # noqa: E402

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
if os.environ.get("MSFP_GEN_SITE_GALLERY") == "1":  # the gallery runs every example
    extensions.append("sphinx_gallery.gen_gallery")
root_doc = "index"
exclude_patterns = [
    "search_texts.js.in",
    "**/GALLERY_HEADER.rst",
    "examples/**",
    "**/sg_execution_times.rst",
    "sg_execution_times.rst",
]
html_theme = "pydata_sphinx_theme"
html_title = f"msfp-gen {release}"
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"**": ["sidebar-collapse", "sidebar-nav-bs", "page-toc"], "index": [], "search": []}
html_theme_options: dict[str, Any] = {
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "show_prev_next": False,
    "secondary_sidebar_items": [],  # the page's contents stand under the section's: code and tables need the width
    "header_links_before_dropdown": 8,
    "footer_start": ["copyright"],
    "footer_end": [],
    "icon_links": [],
}

myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 4
lexers["mermaid"] = TextLexer()  # diagrams are shown as their source: drawing them needs a script from the network

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
autodoc_type_aliases = {"Array": "ndarray", "ArrayLike": "array_like"}
TypeAliasForwardRef.__repr__ = lambda alias: alias.name  # type: ignore[method-assign]  # inside other types
napoleon_use_rtype = False
python_use_unqualified_type_names = True
default_role = "code"
highlight_language = "text"  # blocks without a language are commands and what they print
nitpicky = False

SECTIONS = [f"examples/gallery/{name}" for name in ("bearings", "design", "buildings", "equations", "programs")]
sphinx_gallery_conf = {
    "examples_dirs": "examples/gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "remove_config_comments": True,
    "show_memory": False,
    "thumbnail_size": (480, 336),
    "show_signature": False,
    "download_all_examples": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "subsection_order": SECTIONS,
    "within_subsection_order": "gallery_settings.Order",
    "capture_repr": ("_repr_html_", "__repr__"),
    "ignore_repr_types": r"list|matplotlib",  # what functions of pyplot return
    "image_scrapers": ("matplotlib", "gallery_settings.figures"),
    "reset_modules": ("matplotlib", "gallery_settings.style"),
}


def _mathml(formula: str, display: str) -> str:
    """MathML of LaTeX; ValueError where a command or an alignment would stand in it as text."""
    found = convert(formula.replace("{aligned}", "{align*}"), display=display)
    if re.search(r"<m\w+>(&(?!#)|\\)", found):
        raise ValueError(f"latex2mathml does not know all of {formula}")
    return found


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{_mathml(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


# What annotations become in the pages of the Python interface: arrays by their name, fields without their rules.
TYPES = {
    r"~numpy[\w.]*\._Buffer \| .*?_NestedSequence\[complex \| bytes \| str\]": "array_like",
    r"~numpy\.ndarray\[~?tuple\[~typing\.Any, \.\.\.\], ~numpy\.dtype\[~numpy\.\w+\]\]": "ndarray",
    r"~?\b(?:\w+\.)*ArrayLike\b": "array_like",
    r"~?\b(?:\w+\.)*Array\b": "ndarray",
    r"~dataclasses\.InitVar\[(\w+)\]": r"\1",
    r"~typ(?:es|ing)\.Annotated"
    r"\[((?:[^\[\]]|\[(?:[^\[\]]|\[[^\[\]]*\])*\])+?), ~?[\w.]+\((?:[^()]|\([^()]*\))*\)\]": r"\1",
}


def _types(app: Sphinx, *_: Any) -> None:
    """Simplify the types of parameters before autodoc shows them."""
    for shown in app.env.current_document.autodoc_annotations.values():
        for name in shown:
            for pattern, simple in TYPES.items():
                shown[name] = re.sub(pattern, simple, shown[name])
        if shown.get("return") == "None":
            del shown["return"]


def _docstring(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Prepare a docstring for napoleon, which takes what stands before a colon in a property for its type."""
    if what == "property" and lines:
        head, colon, rest = lines[0].partition(": ")
        lines[:1] = [head + colon.strip(), rest] if colon else [head]
    elif what == "class":  # the fields of a class are its parameters: one list has text and type
        lines[:] = ["Args:" if line == "Attributes:" else line for line in lines]
    if callable(obj) and "Args:" not in lines:
        lines[:] = _listed(inspect.signature(obj).parameters, "\n".join(lines)).splitlines()


def _listed(names: Iterable[str], text: str) -> str:
    """A docstring whose sentences of the kind `name: what it is [unit].` stand in a section Args."""
    name = rf"(?:{'|'.join(map(re.escape, names))})\b"
    head = rf"{name}(?:, {name})*(?=[:;] | \[)"
    body, entries, sections = [], [], []
    for paragraph in text.split("\n\n"):
        if re.match(r"\w+:\n ", paragraph) or not re.search(head, paragraph):
            (sections if re.match(r"\w+:\n ", paragraph) else body).append(paragraph)
            continue
        first, *found = re.split(rf"(?:^|(?<=[.;] ))(?={head})", " ".join(paragraph.split()))
        end = ""
        if found:
            found[-1], *rest = re.split(r"(?<=\. )(?=Raises |Returns )", found[-1], maxsplit=1)
            end = "".join(rest)
        body += [part.strip() for part in (first, end) if part]
        entries += [re.sub(rf"({head})[:;]? ", r"    \1: ", one.strip(" ;"), count=1) for one in found]
    listed = ["Args:\n" + "\n".join(entries)] if entries else []
    return "\n\n".join([*body, *listed, *sections])


def _widths(app: Sphinx, document: nodes.document) -> None:
    """Mark cells of a number and its unit, which stay in one line, and names of the code that are too long for one."""
    cells = list(document.findall(nodes.entry))
    for cell in cells:
        if len(cell.astext()) <= 10:
            cell["classes"].append("short")
    for places, most in ((cells, 20), ([document], 45)):
        for name in (name for place in places for name in place.findall(nodes.literal)):
            if max(map(len, name.astext().split()), default=0) > most:
                name["classes"].append("long")


def setup(app: Sphinx) -> None:
    """Formulas become MathML, which browsers draw without a script; the search shows excerpts without a server."""
    app.connect("object-description-transform", _types, priority=400)
    app.connect("autodoc-process-docstring", _docstring, priority=400)
    app.connect("doctree-read", _widths)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.add_transform(terms.Entries)
    app.connect("html-page-context", excerpts.only_on_search)
    app.connect("build-finished", excerpts.write)


html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
