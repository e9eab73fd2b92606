"""Solvers of a quadratic program: one module for each package, and the table of solvers in `registry`."""
