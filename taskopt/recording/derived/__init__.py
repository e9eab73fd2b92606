"""What follows from a raw log without its scenario and without Rerun: columns, lanes, events, levels.

Everything here is computed from whole columns, so that equal ticks give equal results however the log was cut
into batches.
"""
