"""Tests of a fit: the residual's signature, differences between conditions, drift, evidence, prediction."""
