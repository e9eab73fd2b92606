"""Two arms and a head have tasks on four levels, with two inequalities on the second.

First, TIAGo's left hand draws a circle. Second, the right hand stays in a box, and the head keeps the left
hand inside a viewing cone; both have no effect while they are met. Third, the right hand goes around a circle
that is larger than the box, so that it slides along the sides of the box. Last, the robot keeps the posture
of the start.
"""

from taskopt import (
    BoxTask,
    Circle,
    GazeTask,
    JointAccelerationLimit,
    JointTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

whole = Robot.load("tiago_dual")
robot = whole.lock([joint for joint in whole.joints if not joint.startswith(("torso", "arm", "head"))])

work = Circle(radius=0.1, period=4.0, toward=(0, -1, 0), along=(0, 0, 1))  # [m], [s]
draw = PositionTask("arm_left_tool_link", target=work, gain=20.0)  # [1/s]
keep = BoxTask("arm_right_tool_link", [0.25, -0.86, 0.66], [0.47, -0.65, 0.86], gain=20.0)  # [m], world
look = GazeTask(
    "head_2_link", target=(0.37, 0.66, 0.76), half_angle=0.3, axis=(1, 0, 0), gain=5.0
)  # [m], [rad]
wide = Circle(radius=0.15, period=4.0, toward=(0, 1, 0), along=(1, 0, 0))
reach = PositionTask("arm_right_tool_link", name="right hand's circle", target=wide, gain=20.0)

scenario = Scenario(
    robot=robot,
    q0=robot.posture("middle"),
    stack=Stack(
        levels=[[draw], [keep, look], [reach], [JointTask()]],
        limits=[JointAccelerationLimit(30.0)],  # [rad/s², m/s²]; position and velocity stand in it
    ),
    duration=4.0,
    dt=2e-3,
)
