"""Figures of the report as SVG text: no script, no external font, nothing loaded."""
