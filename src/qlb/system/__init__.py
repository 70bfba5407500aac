"""The mechanical system: mesh, energies, mass and held nodes; and the stage problem that solvers minimise."""

from qlb.system.gravity import Acceleration
from qlb.system.held_nodes import HeldNodes, Motion, Rotation, Translation
from qlb.system.potential import Potential, Term
from qlb.system.stage_problem import StageProblem
from qlb.system.system import System

__all__ = [
    "Acceleration",
    "HeldNodes",
    "Motion",
    "Potential",
    "Rotation",
    "StageProblem",
    "System",
    "Term",
    "Translation",
]
