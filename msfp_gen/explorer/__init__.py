"""The explorer: one HTML page that runs the generated C of a bearing in the browser (docs/explorer.md)."""

from msfp_gen.explorer.page import EXPLORED, explorer_html, write_explorer

__all__ = ["EXPLORED", "explorer_html", "write_explorer"]
