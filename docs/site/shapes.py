"""Shapes of pictures and tables: figures in their size on paper, short cells in one line, long names that may break."""

from __future__ import annotations

import re

from docutils import nodes
from PIL import Image
from sphinx.application import Sphinx

CELL, NAME = 14, 32  # letters of a cell, and of one name or command, that stay in one line


def true_size(app: Sphinx, page: nodes.document) -> None:
    """Figures of 160 dots per inch are shown in inches, so that their letters are as large as the text of a page."""
    for image in page.findall(nodes.image):
        with Image.open(app.srcdir / image["candidates"].get("*", image["uri"])) as picture:
            if "dpi" in picture.info and not image["classes"]:  # pictures of the gallery have a class, and their size
                image["width"] = f"{96 * picture.width / picture.info['dpi'][0]:.0f}px"


def cells(app: Sphinx, page: nodes.document) -> None:
    """Numbers, layouts and keys stay in one line; a long name of a test breaks after its underscores."""
    for entry in page.findall(nodes.entry):
        text = entry.astext()
        names = list(entry.findall(nodes.literal))
        if len(text) <= (NAME if " " not in text or [name.astext() for name in names] == [text] else CELL):
            entry["classes"].append("one-line")
        for name in names:
            if len(name.astext()) > NAME:
                for text in list(name.findall(nodes.Text)):
                    pieces = re.split(r"(?<=[_/])", text.astext())
                    name.remove(text)
                    name += [
                        node for piece in pieces for node in (nodes.Text(piece), nodes.raw("", "<wbr>", format="html"))
                    ]


def setup(app: Sphinx) -> None:
    app.connect("doctree-read", true_size)
    app.connect("doctree-read", cells)
