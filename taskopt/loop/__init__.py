"""The control loop: one tick, which `Controller` and `run` use, and the scenarios that `run` resolves."""
