"""Entries of the index for the words of search_terms.toml: the search lists them before all pages."""

from __future__ import annotations

import tomllib
from pathlib import Path

from docutils import nodes
from sphinx import addnodes
from sphinx.errors import ExtensionError
from sphinx.transforms import SphinxTransform

TERMS: dict[str, list[str]] = tomllib.loads((Path(__file__).parent / "search_terms.toml").read_text(encoding="utf-8"))


class Entries(SphinxTransform):
    """Put the entries of a page into its sections, below their titles."""

    default_priority = 800  # before the entries of a page are collected

    def apply(self) -> None:
        """Raises ExtensionError where a page has no such section."""
        sections = list(self.document.findall(nodes.section))
        for place, terms in TERMS.items():
            page, _, anchor = place.partition("#")
            if page != self.env.docname:
                continue
            found = [one for one in sections if not anchor or anchor in (one.get("slug"), *one["ids"])]
            if not found:
                raise ExtensionError(f"search_terms.toml: {page} has no section {anchor!r}")
            target = found[0]["ids"][0]
            entries = [("single", term, target, "main", None) for term in terms]
            found[0].insert(1, addnodes.index(entries=entries, inline=False))
