"""The campaign as one web page without a network: verdicts, and plots on which values can be read."""
