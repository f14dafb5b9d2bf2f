"""Sections of a report: a batch's results as paragraphs, tables and figures."""
