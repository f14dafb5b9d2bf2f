"""Sections of a report: what a batch's results say, as paragraphs, tables and figures."""
