"""Adaptive sampling: convergence, stopping rules, and the choice between methods."""
