"""The search for effects: trials with their gates, the strategy that adds them, and their rivals."""
