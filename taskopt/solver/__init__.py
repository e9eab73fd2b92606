"""Solvers of one quadratic program: one file for each package, one line for each solver in `registry`."""
