"""The recording of raw logs, in a layout for each purpose, made after the fact.

`recording` is the door: logs in, one Rerun recording out. `arms` are the resolvers of all logs, `scene` draws
their robots, `series` their plots, `lanes` what limits did and what happened, and `layouts` arranges them.
"""
