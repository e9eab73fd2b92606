"""Static inverse kinematics: a posture at which the tasks of a stack are met, or a verdict that says why not.

`solver` has the entry points, `stack` derives what a stack asks of one posture, `descent` goes from one start
to the nearest posture at rest by ticks of the control loop, `starts` supplies the starts, and `verdict`
judges where the descents ended.
"""
