"""A factor with rank-one terms beside it, and the dense matrices behind both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qlb import TetMesh, _native
from qlb.system import System
from tests.support import Array, dense, elastic_hessian, make_system, random_rotation

PRECISIONS = ["float64", "float32", "compact"]
TOLERANCE = {"float64": 1e-10, "float32": 1e-3, "compact": 1e-2}


@dataclass
class Terms:
    """The terms as NumPy arrays, and as a dense matrix."""

    nodes: NDArray[np.int32]
    gamma: Array
    axis: Array
    stiffness: Array

    @property
    def native(self) -> _native.RankOneTerms:
        return _native.RankOneTerms(self.nodes, self.gamma, self.axis, self.stiffness)

    def columns(self, nodes: int) -> Array:
        """a_j as columns, shape (3 nodes, k)."""
        count = len(self.nodes)
        a = np.zeros((count, nodes, 3))
        for slot in range(4):
            a[np.arange(count), self.nodes[:, slot]] += self.gamma[:, slot, None] * self.axis
        return a.reshape(count, 3 * nodes).T

    def dense(self, nodes: int) -> Array:
        C = self.columns(nodes)
        return (C * self.stiffness) @ C.T


def random_terms(rng: np.random.Generator, candidates: NDArray[np.int32], count: int, stiffness: object) -> Terms:
    """Contacts of two and four nodes and, every third, of one node with a plane."""
    nodes = rng.choice(candidates, size=(count, 4)).astype(np.int32)
    gamma = rng.dirichlet(np.ones(4), size=count) * np.array([1, 1, -1, -1])
    nodes[::3] = nodes[::3, :1]
    gamma[::3] = [1.0, 0.0, 0.0, 0.0]
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Terms(nodes, gamma, axis, np.broadcast_to(np.asarray(stiffness, dtype=np.float64), (count,)).copy())


class Body:
    """A box, somewhat deformed, with some held nodes and axes: its factor, and the dense inverse behind it."""

    def __init__(
        self, precision: str, *, cells: tuple[int, int, int] = (6, 3, 3), threads: int = 1, simd: str = ""
    ) -> None:
        rng = np.random.default_rng(5)
        self.mesh = TetMesh.box((1.0, 0.5, 0.5), cells=cells)
        self.system: System = make_system(self.mesh, mass="consistent")
        self.count = len(self.mesh.positions)
        self.reference = self.mesh.positions + 0.005 * rng.normal(size=self.mesh.positions.shape)
        self.x = (self.reference + 0.01 * rng.normal(size=self.reference.shape)) @ random_rotation(rng).T
        self.fixed = np.zeros((self.count, 3), dtype=np.uint8)
        self.fixed[self.mesh.positions[:, 0] < 1e-9] = 1
        self.fixed[self.count // 2, 1] = 1
        self.factor = _native.SupernodalCholesky(self.system.pattern, self.fixed, threads, precision, simd)
        self.factorise(1e4)
        self.inverse = _native.WoodburyInverse(self.factor, self.system.blocks, self.fixed, threads)
        self.carried = False

    def factorise(self, mass: float) -> None:
        self.matrix = elastic_hessian(self.system, self.reference, project=True)
        self.system.inertia.add_hessian(mass, self.matrix)
        assert self.factor.factorise(self.matrix) == -1

    def carry(self) -> None:
        self.inverse.carry(self.x, self.reference, 0.3)
        self.carried = True

    @property
    def free(self) -> NDArray[np.bool_]:
        return np.asarray(self.fixed.ravel() == 0)

    def maps(self) -> Array:
        """T as a dense matrix, with identities where an axis is held."""
        T = np.zeros((self.count, 3, self.count, 3))
        maps = np.tile(np.eye(3), (self.count, 1, 1))
        if self.carried:
            self.system.geometry.nodal_maps(self.x, self.reference, 0.3, maps)
            maps[self.fixed.any(axis=1)] = np.eye(3)
        T[np.arange(self.count), :, np.arange(self.count), :] = maps
        return T.reshape(3 * self.count, 3 * self.count)

    def expected(self, terms: Terms) -> Array:
        """(T^-T B T^-1 + C K C^T)^-1 over the free degrees of freedom."""
        free = np.ix_(self.free, self.free)
        inner = np.zeros((self.free.size, self.free.size))
        inner[free] = np.linalg.inv(dense(self.matrix, self.system.pattern)[free])
        T = self.maps()
        whole = np.zeros_like(inner)
        whole[free] = np.linalg.inv(np.linalg.inv((T @ inner @ T.T)[free]) + terms.dense(self.count)[free])
        return whole

    def stiffness(self) -> float:
        """A stiffness [kg] like those on the diagonal."""
        return float(np.trace(dense(self.matrix, self.system.pattern))) / (3 * self.count)

    def terms(self, count: int, factor: object = 1.0, seed: int = 0) -> Terms:
        """Terms at nodes all over the body, some of them held."""
        rng = np.random.default_rng(seed)
        scale = np.asarray(factor) * self.stiffness() * rng.uniform(0.5, 2.0, size=count)
        return random_terms(rng, np.arange(self.count, dtype=np.int32), count, scale)


def apply(op: _native.InverseOperator, sides: Array) -> Array:
    """Each row of `sides` solved for."""
    out = np.full_like(sides, np.nan)
    for b, x in zip(sides, out, strict=True):
        op.apply(b, x)
    return out


def dense_inverse(body: Body) -> Array:
    return apply(body.inverse, np.eye(3 * body.count)).T


def assert_close(actual: Array, expected: Array, precision: str) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE[precision] * np.abs(expected).max())
