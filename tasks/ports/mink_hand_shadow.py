"""The fingertips of a hand follow one target each, as in `hand_shadow.py` of mink."""

from taskopt import DampedTask, JointPositionLimit, JointTask, Line, PositionTask, Robot, Scenario, Stack

robot, dt = Robot.load("allegro_right_hand"), 1e-3
tips = [
    DampedTask(
        PositionTask(f"link_{tip}_tip", target=Line(by=by, duration=0.5), gain=1.0 / dt),
        factor=1.0,
    )
    for tip, by in {
        "3.0": (0.0, 0.0, 0.02),
        "7.0": (0.0, 0.0, 0.01),
        "11.0": (0.0, 0.0, 0.02),
        "15.0": (0.0, 0.01, 0.0),
    }.items()
]
posture = JointTask(gain=1.0 / dt, weight=1e-2**2)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("middle"),
    stack=Stack([[*tips, posture]], [JointPositionLimit(0.5)]),
    duration=1.0,
    dt=dt,
)
