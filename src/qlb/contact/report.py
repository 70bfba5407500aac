"""Forces of contact, for users and for the output."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from qlb.arrays import FloatArray
from qlb.bodies import Assembly, Body, Obstacle, Plane
from qlb.errors import InputError


@dataclass(frozen=True)
class ContactForces:
    """Forces of contact and friction at a point."""

    nodes: FloatArray
    """on each node, also where it is held [N], shape (n + q, 3)"""
    planes: FloatArray
    """total on each plane [N], shape (p, 3)"""
    energy: float
    """of the barrier or penalty, without friction [J]"""


@dataclass(frozen=True)
class ContactReport:
    """Contact at the end of a step, friction included.

    In dynamics forces are those that the last stage of the integrator feels at its own time, which is the end of the
    step for every integrator here.
    """

    forces: FloatArray
    """on each node [N], shape (n + q, 3): those of bodies, then the vertices of obstacles"""
    count: int
    """active contacts: pairs of a vertex and a face or of two edges, and vertices at planes, nearer than dhat"""
    minimum_distance: float
    """between surfaces that touch [m]; infinite where nothing does"""
    plane_forces: FloatArray
    """total on each plane [N], shape (p, 3)"""
    energy: float
    """of the barrier or penalty, without friction [J]"""
    _assembly: Assembly = field(repr=False)

    def on(self, which: int | str | Body | Obstacle | Plane) -> FloatArray:
        """The total force of contact on a body, an obstacle or a plane [N], shape (3,).

        Args:
            which: itself; its name, or "body 0", "obstacle 0", "plane 0" for the first without one; or its number:
                bodies from 0, then obstacles.

        Raises:
            InputError: there is no such body, obstacle or plane.
        """
        whole = self._assembly
        groups = len(whole.labels) - len(whole.planes)
        if isinstance(which, Plane):
            member = next((groups + k for k, plane in enumerate(whole.planes) if plane is which), None)
            if member is None:
                raise InputError("the plane is not among the obstacles of this simulation")
        elif isinstance(which, str):
            if which not in whole.labels:
                raise InputError(f"{which!r} is not known: must be one of {', '.join(whole.labels)}")
            member = whole.labels.index(which)
        else:
            member = whole.group_of(which)
        if member >= groups:
            return np.array(self.plane_forces[member - groups])
        return np.asarray(self.forces[whole.groups == member].sum(axis=0))
