"""The mechanical system: what does not change from step to step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeGuard

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray, IntArray, LongArray
from qlb.bodies import Assembly, Obstacle, Plane
from qlb.bodies.assembly import assemble
from qlb.contact import Contact
from qlb.contact.model import ContactModel, Surroundings
from qlb.energies import Acceleration, Damping, Energy, Gravity, Potential, Term
from qlb.energies.damping import KelvinVoigt, StiffnessDamping
from qlb.errors import InputError
from qlb.materials.fibres import Fibres
from qlb.materials.material import Material
from qlb.mesh.tet_mesh import TetMesh
from qlb.settings import on_mesh
from qlb.system.assembled import ElasticEnergies
from qlb.system.held_nodes import HeldNodes

MassKind = Literal["lumped", "consistent"]
CholeskyKind = Literal["supernodal", "cholmod"]
Precision = Literal["auto", "compact", "float32", "float64"]


@dataclass(frozen=True)
class Norms:
    """Euclidean norms over the nodes, of what a system has for each."""

    mass: float
    """[kg]"""
    stiffness: float
    """[N]"""
    spring: float
    """[N/m]"""
    viscous_spring: float
    """[N s/m]"""


class System:
    """Bodies, obstacles, mass, loads and held nodes, with the compiled energies over them.

    Nodes are those of the bodies (n), then those of the obstacles (q), which belong to no tet and have no mass.

    Attributes:
        assembly: what it is made of, and which nodes belong to what.
        mesh: all tets, and all n + q nodes where they are at rest.
        blocks: the tets as the compiled kernels take them.
        geometry: what a deformation is like, without any material.
        elastic: the elastic energy of all materials [J].
        potentials: all energies that depend on positions alone [J]: one for each material model, those of fibres.
        contact: what may touch, and how; None where nothing does.
        terms: what has another potential in each stage: loads, damping.
        added: those of `terms` that come from energies which were added: loads on nodes and surfaces, a user's own.
        inertia: 1/2 |x - target|_M^2.
        mass: what each node carries [kg], shape (n + q,): the row sums of the mass matrix.
        stiffness: E_i V_i^(2/3) of each node [N], the force scale of the scaled tolerance, shape (n + q,).
        spring: (lambda + 2 mu)_i V_i^(1/3) of each node [N/m], about a tenth of its diagonal stiffness, shape (n + q,).
        viscous_spring: eta_i V_i^(1/3) of each node [N s/m], as `spring` for viscosity, shape (n + q,).
        incompressibility: mean of (lambda + 2 mu)/E over the bodies.
        energy_scale: sum of (lambda + 2 mu)_e V_e over the elements [J].
    """

    def __init__(
        self,
        bodies: Assembly | TetMesh,
        material: Material | None = None,
        *,
        fibres: Sequence[Fibres] = (),
        obstacles: Iterable[Obstacle | Plane] = (),
        gravity: Acceleration,
        mass: MassKind,
        damping: Damping,
        energies: Sequence[Energy] = (),
        held: HeldNodes,
        contact: Contact | None = None,
        threads: int,
    ) -> None:
        """`bodies` is an assembly, or the mesh of one body of `material` with `fibres` among `obstacles`."""
        whole = bodies if isinstance(bodies, Assembly) else assemble(bodies, material, fibres, None, obstacles)
        self.assembly = whole
        self.mesh = mesh = whole.system_mesh
        self.held = held
        self.damping = on_mesh(damping, "damping", mesh)
        self.threads = threads
        self._cliques = _cliques(mesh, energies)
        self.pattern = _native.BlockPattern(len(mesh.positions), self._cliques)
        made = ElasticEnergies(whole, self.pattern, threads)
        self.blocks = made.blocks
        self.geometry = _native.TetGeometry(made.blocks, threads)
        self.elastic = made.elastic
        self.potentials: list[Potential] = [*made.materials, *made.fibres]
        volumes = mesh.volumes()
        element_mass = whole.per_element(lambda m: m.density) * volumes
        row_begin, columns, values = mass_matrix(mesh, element_mass, mass)
        self.inertia = _native.Inertia(row_begin, columns, values, self.pattern, threads)
        self.mass: FloatArray = _row_sums(row_begin, values)
        self.gravity = Gravity(self.mass, gravity, mesh.positions, threads)
        self._last_stored: tuple[FloatArray, float, float, FloatArray] | None = None
        self.added = [energy.term(mesh, self.pattern, threads) for energy in energies]
        self.terms: list[Term] = [self.gravity, *self._damping_terms(), *self.added]
        modulus = whole.per_element(lambda m: m.modulus())
        stiffest = whole.per_element(lambda m: m.wave_modulus())
        self.stiffness = _node_stiffness(mesh, modulus, 2 / 3)
        self.spring = _node_stiffness(mesh, stiffest, 1 / 3)
        self.viscous_spring = _node_stiffness(mesh, self._viscosity(), 1 / 3)
        self.energy_scale = float(np.sum(stiffest * volumes))
        self.incompressibility = float(np.sum(stiffest / modulus * volumes) / volumes.sum())
        self._fixed = np.flatnonzero(held.fixed.ravel())
        self.contact = (
            None if contact is None else ContactModel(contact, _surroundings(whole, float(modulus.max()), threads))
        )

    def holding(self, held: HeldNodes) -> System:
        """The same system with other nodes held: all but the factor of a solver is shared with this one."""
        other = copy(self)
        other.held, other._fixed = held, np.flatnonzero(held.fixed.ravel())
        return other

    def _damping_terms(self) -> list[Term]:
        terms: list[Term] = []
        if self.damping.stiffness > 0:
            terms.append(StiffnessDamping(self.damping.stiffness, self.potentials, self.pattern, self.threads))
        if self._viscosity().any():
            terms.append(KelvinVoigt(self.blocks, self._viscosity(), self.threads))
        return terms

    def _viscosity(self) -> FloatArray:
        """eta of each element [Pa s], shape (m,)."""
        viscosity = np.asarray(self.damping.viscosity, dtype=np.float64)
        return np.ascontiguousarray(np.broadcast_to(viscosity, (len(self.mesh.tets),)))

    @cached_property
    def norms(self) -> Norms:
        """Those of `mass`, `stiffness`, `spring` and `viscous_spring`."""
        values = (self.mass, self.stiffness, self.spring, self.viscous_spring)
        return Norms(*(self.norm(value) for value in values))

    @property
    def hessian_is_of_positions(self) -> bool:
        """Whether the Hessian of a stage follows from positions, c and damping.mass: no term but gravity has a part."""
        return len(self.terms) == 1

    @property
    def nodes(self) -> int:
        """Number of nodes n + q."""
        return len(self.mesh.positions)

    @property
    def rest(self) -> FloatArray:
        """Rest positions [m], shape (n + q, 3)."""
        return self.mesh.positions

    @property
    def groups(self) -> IntArray:
        """Which body or obstacle each node belongs to, shape (n + q,): body b is b, obstacle o is bodies + o."""
        return self.assembly.groups

    @property
    def surface_faces(self) -> IntArray:
        """Outward boundary triangles of the bodies, then the triangles of the obstacles, shape (f, 3)."""
        return self.assembly.surface_faces

    @property
    def planes(self) -> tuple[Plane, ...]:
        """The half-spaces, which have no nodes."""
        return self.assembly.planes

    def takes_along(self, potential: Potential) -> TypeGuard[_native.Viscosity]:
        """Whether `potential` is viscosity that the loop over the elements of all bodies can take along."""
        return isinstance(potential, _native.Viscosity) and isinstance(self.elastic, _native.ElasticEnergy)

    def viscous_energy(self, x: FloatArray, viscosity: _native.Viscosity, scale: float) -> tuple[float, FloatArray]:
        """The sum of `potentials` and `viscosity` at positions `x` (n, 3) [m], and its gradient, both times `scale`."""
        assert isinstance(self.elastic, _native.ElasticEnergy)
        gradient = np.zeros(x.shape)
        energy = self.elastic.add_viscous_value_gradient(x, viscosity, scale, gradient)
        fibres = (part for part in self.potentials if part is not self.elastic)
        return energy + sum(part.add_value_gradient(x, scale, gradient) for part in fibres), gradient

    def stored_energy(self, x: FloatArray, scale: float) -> tuple[float, FloatArray]:
        """The sum of `potentials` at positions `x` (n, 3) [m], and its gradient, both times `scale`; not to be changed.

        What was found last is not worked out again: where a step ends the next one begins.
        """
        last = self._last_stored
        if last is None or last[1] != scale or not np.array_equal(last[0], x):
            gradient = np.zeros(x.shape)
            energy = 0.0 + sum(part.add_value_gradient(x, scale, gradient) for part in self.potentials)
            last = self._last_stored = x.copy(), scale, energy, gradient
        return last[2], last[3]

    def clear_held(self, gradient: FloatArray) -> FloatArray:
        """Zero the entries of `gradient` (n, 3) that belong to held degrees of freedom, in place."""
        gradient.reshape(-1)[self._fixed] = 0.0
        return gradient

    def is_inverted(self, x: FloatArray) -> bool:
        """Whether a tet is turned inside out, flat, or not a number, at positions `x` (n, 3) [m]."""
        return not self.geometry.least_J(x) > 0

    def dot(self, a: FloatArray, b: FloatArray) -> float:
        """Inner product, the same bits for any number of threads."""
        return _native.dot(a, b, self.threads)

    def norm(self, a: FloatArray) -> float:
        """Euclidean norm, the same bits for any number of threads."""
        return float(np.sqrt(self.dot(a, a)))

    def analyse(
        self,
        kind: CholeskyKind = "supernodal",
        precision: Precision = "float64",
        *,
        pattern: _native.BlockPattern | None = None,
        order: IntArray | None = None,
    ) -> _native.Cholesky:
        """A Cholesky factorisation of the free degrees of freedom, ordered and analysed, not yet factorised.

        Args:
            kind: whose.
            precision: of its numbers; "auto" begins with "compact".
            pattern: an extended one, instead of that of the system.
            order: the nodes in the order of their elimination, shape (n,); METIS finds one by default.
        """
        pattern = pattern or self.pattern
        if kind == "supernodal":
            first = "compact" if precision == "auto" else precision
            return _native.SupernodalCholesky(pattern, self.held.fixed, self.threads, first, order=order)
        if not hasattr(_native, "CholmodCholesky"):
            raise InputError("cholesky = 'cholmod' is not in this build: see 'Reference' in docs/components.md")
        if precision != "float64":
            raise InputError(f"precision = {precision!r} is not to be had from cholmod: must be 'float64'")
        return _native.CholmodCholesky(pattern, self.held.fixed, self.threads)

    def extended_pattern(self, stencils: IntArray) -> _native.BlockPattern:
        """The pattern of the Hessian with blocks for all pairs of each of `stencils` (k, 4) in addition."""
        return _native.BlockPattern(self.nodes, np.concatenate([self._cliques, stencils]))


def _surroundings(whole: Assembly, young: float, threads: int) -> Surroundings:
    rest, faces = whole.system_mesh.positions, whole.surface_faces
    return Surroundings(rest, faces, whole.groups, len(whole.bodies), whole.labels, whole.planes, young, threads)


def _cliques(mesh: TetMesh, energies: Sequence[Energy]) -> IntArray:
    """Sets of four nodes that are coupled: the tets, and each pair that an energy couples, filled up by repetition."""
    cliques = [mesh.tets]
    for energy in energies:
        sets = energy.node_sets(mesh)
        first, second = np.triu_indices(sets.shape[1], k=1)
        pairs = np.stack([sets[:, first].ravel(), sets[:, second].ravel()], axis=1)
        cliques.append(np.unique(pairs, axis=0)[:, [0, 1, 1, 1]])
    return np.concatenate(cliques)


def mass_matrix(mesh: TetMesh, element_mass: FloatArray, kind: MassKind) -> tuple[LongArray, IntArray, FloatArray]:
    """The node mass matrix [kg] in compressed sparse rows: row begins (n + 1), columns, values.

    Lumped: a quarter of each element to each of its nodes. Consistent: integrals of the products of the linear shape
    functions, element_mass (1 + delta_ij)/20 (Zienkiewicz, Taylor 2000, vol. 1, ch. 17).
    """
    n = len(mesh.positions)
    if kind == "lumped":
        share = np.repeat(element_mass / 4, 4)
        lumped = np.bincount(mesh.tets.ravel(), weights=share, minlength=n).astype(np.float64)
        return np.arange(n + 1, dtype=np.int64), np.arange(n, dtype=np.int32), lumped
    if kind != "consistent":
        raise InputError(f"mass = {kind!r} must be 'lumped' or 'consistent'")
    local = (np.ones((4, 4)) + np.eye(4)) / 20
    i = np.repeat(mesh.tets, 4, axis=1).astype(np.int64)
    j = np.tile(mesh.tets, (1, 4)).astype(np.int64)
    entries, inverse = np.unique((i * n + j).ravel(), return_inverse=True)
    values = np.bincount(inverse.ravel(), weights=np.outer(element_mass, local).ravel()).astype(np.float64)
    row_begin = np.searchsorted(entries, np.arange(n + 1, dtype=np.int64) * n)
    return row_begin.astype(np.int64), (entries % n).astype(np.int32), values


def _node_stiffness(mesh: TetMesh, modulus: FloatArray, power: float) -> FloatArray:
    """E_i V_i^power of each node, from means over its elements, shape (nodes,); 0 where there are none."""
    nodes, share = mesh.tets.ravel(), np.repeat(mesh.volumes() / 4, 4)
    volume = np.bincount(nodes, weights=share, minlength=len(mesh.positions))
    stiffness = np.bincount(nodes, weights=share * np.repeat(modulus, 4), minlength=len(mesh.positions))
    used = volume > 0
    result = np.zeros(len(volume))
    result[used] = stiffness[used] * volume[used] ** (power - 1)
    return result


def _row_sums(row_begin: LongArray, values: FloatArray) -> FloatArray:
    """Sums of the rows of a matrix in compressed sparse rows; empty ones have 0."""
    used = row_begin[1:] > row_begin[:-1]
    sums = np.zeros(len(used))
    sums[used] = np.add.reduceat(values, row_begin[:-1][used])
    return sums
