"""What people call: one module for each command that shows results; the stages' are in ``metro.stages``."""
