"""Tasks: the goals that a stack puts into levels."""

from taskopt.kinematics.task.alignment import AxisAlignmentTask as AxisAlignmentTask
from taskopt.kinematics.task.alignment import LookAtTask as LookAtTask
from taskopt.kinematics.task.base import BoundTask as BoundTask
from taskopt.kinematics.task.base import Task as Task
from taskopt.kinematics.task.centre_of_mass import CentreOfMassTask as CentreOfMassTask
from taskopt.kinematics.task.coupling import JointCouplingTask as JointCouplingTask
from taskopt.kinematics.task.coupling import LinearHolonomicTask as LinearHolonomicTask
from taskopt.kinematics.task.damped import DampedTask as DampedTask
from taskopt.kinematics.task.damping import DampingTask as DampingTask
from taskopt.kinematics.task.frame import FrameTask as FrameTask
from taskopt.kinematics.task.frame import OrientationTask as OrientationTask
from taskopt.kinematics.task.frame import PositionTask as PositionTask
from taskopt.kinematics.task.inequality import BoxTask as BoxTask
from taskopt.kinematics.task.inequality import GazeTask as GazeTask
from taskopt.kinematics.task.joint import JointTask as JointTask
from taskopt.kinematics.task.level_damping import LevelDamping as LevelDamping
from taskopt.kinematics.task.loop import LoopTask as LoopTask
from taskopt.kinematics.task.objective import GradientTask as GradientTask
from taskopt.kinematics.task.objective import ObjectiveTask as ObjectiveTask
from taskopt.kinematics.task.orientation_error import AngleAxisTask as AngleAxisTask
from taskopt.kinematics.task.orientation_error import EulerTask as EulerTask
from taskopt.kinematics.task.orientation_error import QuaternionTask as QuaternionTask
from taskopt.kinematics.task.relative import RelativeFrameTask as RelativeFrameTask
from taskopt.kinematics.task.transition import During as During
from taskopt.kinematics.task.velocity import JointVelocityTask as JointVelocityTask
from taskopt.kinematics.task.velocity import LowAccelerationTask as LowAccelerationTask
