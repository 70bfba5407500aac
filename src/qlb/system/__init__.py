"""The mechanical system: mesh, energies, mass and held nodes; and the stage problem that solvers minimise."""

from qlb.system.held_nodes import HeldNodes
from qlb.system.motions import Keyframes, Motion, Rotation, Translation, VertexAnimation
from qlb.system.stage_problem import StageProblem
from qlb.system.system import System

__all__ = [
    "HeldNodes",
    "Keyframes",
    "Motion",
    "Rotation",
    "StageProblem",
    "System",
    "Translation",
    "VertexAnimation",
]
