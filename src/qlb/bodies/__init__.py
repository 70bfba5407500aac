"""What a simulation is made of: bodies, and the obstacles that they may meet."""

from qlb.bodies.assembly import Assembly
from qlb.bodies.body import Body, Placement
from qlb.bodies.obstacles import Obstacle, Plane

__all__ = ["Assembly", "Body", "Obstacle", "Placement", "Plane"]
