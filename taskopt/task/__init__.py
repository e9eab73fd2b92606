"""Tasks: what a stack may ask for."""

from taskopt.task.base import BoundTask as BoundTask
from taskopt.task.base import Task as Task
from taskopt.task.centre_of_mass import CentreOfMassTask as CentreOfMassTask
from taskopt.task.damping import LevelDamping as LevelDamping
from taskopt.task.during import During as During
from taskopt.task.frame import FrameTask as FrameTask
from taskopt.task.frame import OrientationTask as OrientationTask
from taskopt.task.frame import PositionTask as PositionTask
from taskopt.task.gradient import GradientTask as GradientTask
from taskopt.task.inequality import BoxTask as BoxTask
from taskopt.task.inequality import GazeTask as GazeTask
from taskopt.task.joint import JointTask as JointTask
from taskopt.task.objective import ObjectiveTask as ObjectiveTask
from taskopt.task.velocity import DampingTask as DampingTask
