"""HTML pages without network: of a run or a suite (docs/figures.md), of a fit (docs/properties.md), the explorer."""

from msfp_gen.report.analysis import analysis_html, write_analysis
from msfp_gen.report.frames import FRAMES, REPORT_SUFFIXES
from msfp_gen.report.page import TitleBlock, fit_html, report_html, write_fit_report, write_report

__all__ = [
    "FRAMES", "REPORT_SUFFIXES", "TitleBlock", "analysis_html", "fit_html", "report_html", "write_analysis",
    "write_fit_report", "write_report",
]  # fmt: skip
