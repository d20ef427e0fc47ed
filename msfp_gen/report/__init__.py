"""HTML report of a run: one file with tables, figures and an interactive view, without network (docs/report.md)."""

from msfp_gen.report.content import TitleBlock
from msfp_gen.report.frames import FRAMES
from msfp_gen.report.page import REPORT_SUFFIXES, report_html, write_report

__all__ = ["FRAMES", "REPORT_SUFFIXES", "TitleBlock", "report_html", "write_report"]
