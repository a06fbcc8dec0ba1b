"""The printable report of a plan: one page without script that loads nothing, and its figures."""

from planning.report.page import ReportInput, TradeRow, render_report

__all__ = ["ReportInput", "TradeRow", "render_report"]
