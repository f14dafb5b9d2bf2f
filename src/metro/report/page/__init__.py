"""The campaign as one web page that needs no network: verdicts, and plots with readable values."""
