"""What acts on a body beside its material: gravity, loads, damping, and energies of the user's own."""

from qlb.energies.damping import Damping
from qlb.energies.energy import Energy, NodalEnergy, StencilEnergy
from qlb.energies.gravity import Acceleration, Gravity
from qlb.energies.loads import PointForce, Traction
from qlb.energies.potential import DeadLoad, Potential, Term
from qlb.energies.pressure import Pressure

__all__ = [
    "Acceleration",
    "Damping",
    "DeadLoad",
    "Energy",
    "Gravity",
    "NodalEnergy",
    "PointForce",
    "Potential",
    "Pressure",
    "StencilEnergy",
    "Term",
    "Traction",
]
