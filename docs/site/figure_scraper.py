"""Figures of the gallery: those of the package do not pass through pyplot, which sphinx-gallery asks for figures."""

from __future__ import annotations

from typing import Any

from sphinx_gallery.scrapers import figure_rst


def figures(_: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """The image of what a block of an example leaves as `figure`."""
    figure = variables["example_globals"].pop("figure", None)
    if figure is None:
        return ""
    path = next(variables["image_path_iterator"])
    figure.savefig(path, dpi=110)
    return str(figure_rst([path], configuration["src_dir"]))
