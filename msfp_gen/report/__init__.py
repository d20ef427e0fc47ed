"""HTML pages without network: a run with an interactive view (docs/report.md), a fit (docs/fit.md), the explorer."""

from msfp_gen.report.frames import FRAMES, REPORT_SUFFIXES
from msfp_gen.report.page import TitleBlock, fit_html, report_html, write_fit_report, write_report

__all__ = ["FRAMES", "REPORT_SUFFIXES", "TitleBlock", "fit_html", "report_html", "write_fit_report", "write_report"]
