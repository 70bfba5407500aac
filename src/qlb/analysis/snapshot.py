"""A state with what it is made of, and everything that follows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from qlb.analysis import motion, strain, stress
from qlb.analysis.constitution import Constitution
from qlb.arrays import FloatArray, vectors
from qlb.errors import InputError
from qlb.integrators import State
from qlb.integrators.integrator import Stage
from qlb.simulation import Simulation
from qlb.system import System


@dataclass(frozen=True)
class Energies:
    """Energy by kind [J]. What friction, damping and held nodes do is work, and no part of it."""

    kinetic: float
    elastic: float
    """of materials and fibres; 0 at rest"""
    gravity: float
    """0 where every node is at its place at rest"""
    contact: float
    """of the barrier or penalty"""
    loads: float
    """of loads and energies that were added"""

    @property
    def total(self) -> float:
        """Their sum [J]."""
        return self.kinetic + self.elastic + self.gravity + self.contact + self.loads


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A state of a simulation or a run; everything else is computed when first asked for.

    Arrays over tets have one row for each of the m tets, those over nodes one for each of the n nodes of the bodies, in
    the order of `Simulation.mesh`; positions, velocities and contact forces have those of obstacles behind.
    """

    constitution: Constitution
    time: float
    """[s]"""
    positions: FloatArray
    """[m], shape (n + q, 3)"""
    velocities: FloatArray
    """[m/s], shape (n + q, 3)"""
    contact_forces: FloatArray
    """of contact and friction on each node [N], shape (n + q, 3); zero before the first step"""
    gravity: FloatArray | None = None
    """acceleration [m/s^2], shape (3,); None where it is not known"""
    contact_energy: float = 0.0
    """[J]"""
    load_energy: float = 0.0
    """of loads and energies that were added [J]"""

    @staticmethod
    def of(simulation: Simulation, constitution: Constitution | None = None) -> Snapshot:
        """A simulation as it is now; contact is that at the end of its last step. Nodes cannot be pinned any more.

        `constitution` saves time where there is one of an earlier snapshot.
        """
        state, contact = simulation.state, simulation.contact_now
        return Snapshot(
            constitution or Constitution.of(simulation),
            state.time,
            state.positions,
            state.velocities,
            np.zeros_like(state.positions) if contact is None else contact.forces,
            simulation.system.gravity.acceleration(state.time),
            0.0 if contact is None else contact.energy,
            load_energy(simulation.system, state, simulation.step),
        )

    @cached_property
    def deformation_gradient(self) -> FloatArray:
        """F of each tet, shape (m, 3, 3)."""
        return strain.deformation_gradients(self.positions, self._tets, self.constitution.inverse_rest)

    @cached_property
    def volume_ratio(self) -> FloatArray:
        """J = det F of each tet, shape (m,)."""
        return np.asarray(np.linalg.det(self.deformation_gradient))

    @cached_property
    def green_lagrange_strain(self) -> FloatArray:
        """E = (F^T F - 1)/2 of each tet, shape (m, 3, 3)."""
        return strain.green_lagrange(self.deformation_gradient)

    @cached_property
    def principal_stretches(self) -> FloatArray:
        """Singular values of F, the largest first, shape (m, 3); the last is negative in an inverted tet."""
        return strain.principal_stretches(self.deformation_gradient)

    @cached_property
    def energy_density(self) -> FloatArray:
        """Elastic energy per volume at rest [Pa], shape (m,). As all that follows, raises `InputError` for a run whose
        material is a density of the user's own.
        """
        return self._evaluated[0]

    @cached_property
    def first_piola_kirchhoff_stress(self) -> FloatArray:
        """P = dpsi/dF [Pa]: force per area at rest, shape (m, 3, 3)."""
        return self._evaluated[1]

    @cached_property
    def cauchy_stress(self) -> FloatArray:
        """P F^T/J [Pa]: force per area as it is now, shape (m, 3, 3)."""
        return stress.cauchy(self.first_piola_kirchhoff_stress, self.deformation_gradient)

    @cached_property
    def von_mises_stress(self) -> FloatArray:
        """sqrt(3/2 s:s) [Pa], s the deviator of Cauchy's stress, shape (m,)."""
        return stress.von_mises(self.cauchy_stress)

    @cached_property
    def energies(self) -> Energies:
        """Energy by kind [J]. Raises `InputError` where gravity is not known."""
        whole = self.constitution
        if self.gravity is None:
            raise InputError("energies of this state are not known: its run was written by an earlier version of qlb")
        lift = whole.node_mass @ (self._of_bodies(self.positions) - whole.mesh.positions)
        return Energies(
            kinetic=motion.kinetic_energy(self.velocities, self._tets, whole.element_mass, whole.mass),
            elastic=float(np.dot(whole.volumes, self.energy_density)),
            gravity=-float(self.gravity @ lift),
            contact=self.contact_energy,
            loads=self.load_energy,
        )

    @cached_property
    def linear_momentum(self) -> FloatArray:
        """Of all bodies [kg m/s], shape (3,)."""
        return motion.linear_momentum(self.velocities, self._tets, self.constitution.element_mass)

    def angular_momentum(self, about: npt.ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
        """Of all bodies about a point [m] [kg m^2/s], shape (3,)."""
        arms = self.positions - vectors("about", about, (3,))
        whole = self.constitution
        return motion.angular_momentum(arms, self.velocities, self._tets, whole.element_mass, whole.mass)

    def at_nodes(self, values: FloatArray) -> FloatArray:
        """Values over tets (m, ...) at the nodes (n, ...): means over the tets of a node, by their volume at rest."""
        rows = np.reshape(values, (len(self._tets), -1))
        nodes, count = self._tets.ravel(), len(self.constitution.mesh.positions)
        share = np.repeat(self.constitution.volumes, 4)
        sums = np.stack([np.bincount(nodes, share * np.repeat(column, 4), count) for column in rows.T], axis=1)
        means = sums / np.bincount(nodes, share, count)[:, None]
        return np.asarray(means.reshape(count, *np.shape(values)[1:]))

    def at_surface(self, values: FloatArray) -> FloatArray:
        """Values over tets (m, ...) at the vertices of the surface that is shown, `mesh.rendered()`, (v, ...)."""
        return self.constitution.mesh.rendered().of_nodes(self.at_nodes(values))

    @property
    def _tets(self) -> npt.NDArray[np.int32]:
        return self.constitution.mesh.tets

    @cached_property
    def _evaluated(self) -> tuple[FloatArray, FloatArray]:
        return self.constitution.evaluate(self.deformation_gradient)

    def _of_bodies(self, values: FloatArray) -> FloatArray:
        return values[: len(self.constitution.mesh.positions)]


def load_energy(system: System, state: State, step: float) -> float:
    """Of loads and energies that were added to a simulation [J], at a state of it.

    The pressure on an open surface takes its rim where it is.
    """
    stage = Stage(state.time, step, ((1.0, state.positions),), state.velocities)
    potentials = (term.at(stage, state.positions) for term in system.added)
    ignored = np.zeros_like(state.positions)
    return float(sum(p.add_value_gradient(state.positions, 1.0, ignored) for p in potentials if p is not None))
