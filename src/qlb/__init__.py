"""qlb: fast, dependable time integration of hyperelastic solids."""

import os as _os
from importlib.metadata import version as _version

# Threads of OpenMP that spin while BLAS works (or the other way round) slow both several times over. It must be set
# before the OpenMP runtime is loaded; a value that the user has set wins.
_os.environ.setdefault("OMP_WAIT_POLICY", "passive")

from qlb import shapes
from qlb.bodies import Body, Obstacle, Placement, Plane
from qlb.contact import Contact, ContactPair, ContactReport
from qlb.energies import Damping, Energy, NodalEnergy, PointForce, Pressure, StencilEnergy, Traction
from qlb.errors import InputError, QlbError, QlbWarning
from qlb.fields import TimeExpression, TimeTable
from qlb.integrators import State
from qlb.materials import (
    Arap,
    CompressibleNeoHookean,
    Fibres,
    FixedCorotational,
    LinearElastic,
    MooneyRivlin,
    StableNeoHookean,
    StVenantKirchhoff,
    SymbolicMaterial,
)
from qlb.mesh import TetMesh
from qlb.simulation import Simulation
from qlb.solvers import Reason, SolverSettings, Tolerance
from qlb.step_result import StepFailed, StepResult
from qlb.system import Keyframes, Rotation, Translation, VertexAnimation

__version__ = _version("qlb")

__all__ = [
    "Arap",
    "Body",
    "CompressibleNeoHookean",
    "Contact",
    "ContactPair",
    "ContactReport",
    "Damping",
    "Energy",
    "Fibres",
    "FixedCorotational",
    "InputError",
    "Keyframes",
    "LinearElastic",
    "MooneyRivlin",
    "NodalEnergy",
    "Obstacle",
    "Placement",
    "Plane",
    "PointForce",
    "Pressure",
    "QlbError",
    "QlbWarning",
    "Reason",
    "Rotation",
    "Simulation",
    "SolverSettings",
    "StVenantKirchhoff",
    "StableNeoHookean",
    "State",
    "StencilEnergy",
    "StepFailed",
    "StepResult",
    "SymbolicMaterial",
    "TetMesh",
    "TimeExpression",
    "TimeTable",
    "Tolerance",
    "Traction",
    "Translation",
    "VertexAnimation",
    "__version__",
    "shapes",
]
