"""The control loop: one tick, used by `Controller` and by `run`; and the scenarios that a run resolves."""
