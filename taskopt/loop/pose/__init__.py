"""Static inverse kinematics: a posture at which the tasks of a stack are met, or a verdict that says why not.

`solver` has the entry points, `stack` says what a stack asks of one posture, `descent` goes from one start to
the nearest rest by ticks of the control loop, `starts` knows where to begin, and `verdict` judges the end.
"""
