"""Energies as a user would write them."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from qlb import NodalEnergy, StencilEnergy, TetMesh
from tests.support import Array


class Springs(StencilEnergy):
    """Springs [N/m] between pairs of nodes, whose lengths at rest [m] may grow in time [m/s]."""

    def __init__(self, pairs: ArrayLike, stiffness: float, length: ArrayLike, growth: float = 0.0) -> None:
        self.stencils, self.stiffness, self.length, self.growth = pairs, stiffness, length, growth

    def _state(self, x: Array, time: float) -> tuple[Array, Array, Array]:
        d = x[:, 1] - x[:, 0]
        now = np.linalg.norm(d, axis=1)
        return d / now[:, None], now, np.asarray(self.length) + self.growth * time

    def value(self, x: Array, time: float) -> ArrayLike:
        _, now, rest = self._state(x, time)
        return 0.5 * self.stiffness * (now - rest) ** 2

    def gradient(self, x: Array, time: float) -> ArrayLike:
        n, now, rest = self._state(x, time)
        pull = self.stiffness * (now - rest)[:, None] * n
        return np.stack([-pull, pull], axis=1)

    def hessian(self, x: Array, time: float) -> ArrayLike:
        n, now, rest = self._state(x, time)
        along = n[:, :, None] * n[:, None, :]
        B = self.stiffness * (along + (1 - rest / now)[:, None, None] * (np.eye(3) - along))
        return np.block([[B, -B], [-B, B]])


class Tethers(StencilEnergy):
    """Single nodes on springs without length to places that move with a constant velocity."""

    def __init__(self, nodes: ArrayLike, places: Array, stiffness: float, velocity: ArrayLike = (0, 0, 0)) -> None:
        self.stencils = np.reshape(nodes, (-1, 1))
        self.places, self.stiffness, self.velocity = places, stiffness, np.asarray(velocity)

    def _off(self, x: Array, time: float) -> Array:
        return x[:, 0] - self.places - time * self.velocity

    def value(self, x: Array, time: float) -> ArrayLike:
        return 0.5 * self.stiffness * np.sum(self._off(x, time) ** 2, axis=1)

    def gradient(self, x: Array, time: float) -> ArrayLike:
        return self.stiffness * self._off(x, time)[:, None]

    def hessian(self, x: Array, time: float) -> ArrayLike:
        return np.broadcast_to(self.stiffness * np.eye(3), (len(x), 3, 3))


class Gyration(StencilEnergy):
    """k/4 (sum over the nodes of one stencil of |x_a - x_mean|^2 - R2)^2: one stencil of many nodes."""

    def __init__(self, nodes: ArrayLike, stiffness: float, target: float) -> None:
        self.stencils, self.stiffness, self.target = np.reshape(nodes, (1, -1)), stiffness, target

    def _spread(self, x: Array) -> tuple[Array, Array]:
        r = x - x.mean(axis=1, keepdims=True)
        return r, np.sum(r**2, axis=(1, 2)) - self.target

    def value(self, x: Array, time: float) -> ArrayLike:
        return 0.25 * self.stiffness * self._spread(x)[1] ** 2

    def gradient(self, x: Array, time: float) -> ArrayLike:
        r, excess = self._spread(x)
        return self.stiffness * excess[:, None, None] * r

    def hessian(self, x: Array, time: float) -> ArrayLike:
        r, excess = self._spread(x)
        w = x.shape[1]
        centring = np.kron(np.eye(w) - 1.0 / w, np.eye(3))
        flat = r.reshape(len(r), -1)
        return self.stiffness * (excess[:, None, None] * centring + 2 * flat[:, :, None] * flat[:, None, :])


class Laplacian(NodalEnergy):
    """k/2 sum over edges of the tets of |u_i - u_j|^2, u the displacement."""

    def __init__(self, mesh: TetMesh, stiffness: float) -> None:
        i, j = np.triu_indices(4, 1)
        edges = np.unique(np.sort(np.stack([mesh.tets[:, i].ravel(), mesh.tets[:, j].ravel()], axis=1), axis=1), axis=0)
        k, n = np.arange(len(edges)), len(mesh.positions)
        ones = np.ones(len(edges))
        D = sp.csr_matrix((np.r_[ones, -ones], (np.r_[k, k], edges.T.ravel())), shape=(len(edges), n))
        self.rest, self.L = mesh.positions, stiffness * sp.kron(D.T @ D, sp.eye(3), format="csr")

    def value(self, x: Array, time: float) -> float:
        u = (x - self.rest).ravel()
        return 0.5 * float(u @ (self.L @ u))

    def gradient(self, x: Array, time: float) -> ArrayLike:
        return (self.L @ (x - self.rest).ravel()).reshape(-1, 3)

    def hessian(self, x: Array, time: float, project: bool) -> Any:
        return self.L


class Centre(NodalEnergy):
    """k/2 |x_c - place|^2, x_c the centre of mass: it couples all nodes with each other."""

    def __init__(self, mass: Array, stiffness: float, place: ArrayLike, velocity: ArrayLike = (0, 0, 0)) -> None:
        self.weights, self.stiffness = mass / mass.sum(), stiffness
        self.place, self.velocity = np.asarray(place), np.asarray(velocity)
        self.couplings = np.arange(len(mass))[None]

    def _off(self, x: Array, time: float) -> Array:
        return self.weights @ x - self.place - time * self.velocity

    def value(self, x: Array, time: float) -> float:
        return 0.5 * self.stiffness * float(np.sum(self._off(x, time) ** 2))

    def gradient(self, x: Array, time: float) -> ArrayLike:
        return self.stiffness * np.outer(self.weights, self._off(x, time))

    def hessian(self, x: Array, time: float, project: bool) -> Any:
        return sp.kron(sp.csr_matrix(self.stiffness * np.outer(self.weights, self.weights)), sp.eye(3), format="coo")


def node_mass(mesh: TetMesh, density: float = 1000.0) -> Array:
    return np.bincount(mesh.tets.ravel(), np.repeat(density * mesh.volumes() / 4, 4), len(mesh.positions))
