"""Kinematics and rows of many arms in lock-step, eight at a time (see `taskopt.jit.pack`).

`tables` reads a plan into arrays, `chain` places the joints, `frame_rows` and `rows` fill the hierarchy of
each arm. Poses are twelve packs: the columns of the rotation one after another, then the translation [m].
"""
