"""The loop where the measurement is a label, stable or unstable."""
