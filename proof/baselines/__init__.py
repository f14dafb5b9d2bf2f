"""Plain programs that stand beside ours on the board: what each names, and how it corrects a prediction."""

BASELINES = ("base", "gaussian-process", "stepwise")
