"""The results of one batch in Python: tables, identified quantities, verdicts, predictions, fits, figures."""
