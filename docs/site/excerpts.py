"""Texts of all pages for the excerpts of the search, which a browser may not fetch from a folder of files."""

from __future__ import annotations

import json
from html import escape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

SCRIPT = "search_texts.js"
LEFT_OUT = ("script", "style", "svg", "math")


class Article(HTMLParser):
    """The text of the article of a page, with the sections that links of the search lead to."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []
        self._inside = self._skipped = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "article" and "bd-article" in (given.get("class") or ""):
            self._inside += 1
        elif tag in LEFT_OUT:
            self._skipped += 1
        elif self._inside and tag in ("section", "dt") and given.get("id"):
            self.parts.append(f'<{tag} id="{escape(str(given["id"]))}">')
        elif self._inside and tag in ("section", "dt"):
            self.parts.append(f"<{tag}>")

    def handle_endtag(self, tag: str) -> None:
        if tag == "article":
            self._inside = 0
        elif tag in LEFT_OUT:
            self._skipped -= 1
        elif self._inside and tag in ("section", "dt"):
            self.parts.append(f"</{tag}>")

    def handle_data(self, data: str) -> None:
        if self._inside and not self._skipped:
            self.parts.append(escape(" ".join(data.split()) + " " if data.strip() else " "))


def only_on_search(app: Sphinx, page: str, *_: Any) -> None:
    """Load the texts on the page of the search alone."""
    if page == "search":
        app.add_js_file(SCRIPT, priority=100)  # before the script of the search


def write(app: Sphinx, error: Exception | None) -> None:
    """Write the texts of all pages beside the scripts of the site."""
    if error is not None:
        return
    folder, texts = Path(app.outdir), {}
    for path in sorted(folder.rglob("*.html")):
        name = path.relative_to(folder).with_suffix("").as_posix()
        if not name.startswith("_"):
            article = Article()
            article.feed(path.read_text(encoding="utf-8"))
            texts[name] = f'<div role="main">{"".join(article.parts)}</div>'
    script = (Path(__file__).parent / "search_texts.js.in").read_text(encoding="utf-8")
    (folder / "_static" / SCRIPT).write_text(script.replace("TEXTS", json.dumps(texts)), encoding="utf-8")
