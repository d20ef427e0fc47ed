"""A run as one HTML file that needs no network: numbers, settings, figures and an interactive view (docs/report.md)."""

from msfp_gen.report.frames import FRAMES
from msfp_gen.report.page import REPORT_SUFFIXES, report_html, write_report

__all__ = ["FRAMES", "REPORT_SUFFIXES", "report_html", "write_report"]
