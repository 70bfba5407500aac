"""What several tests need: random rotations, small meshes, dense copies, fitted orders."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from qlb import Damping, Energy, Simulation, SolverSettings, StableNeoHookean, State, TetMesh, Tolerance, _native
from qlb.system import HeldNodes, System

Array = NDArray[np.float64]

# Close to what rounding allows. The absolute part ends solves with a tiny step, whose whole |g(x_k)| is small:
# 2e-14 kg m is an error of 1e-14 m in the place of a node of 2 kg.
TIGHT = Tolerance(relative=1e-11, absolute=2e-14)
ROBUST_NEWTON = SolverSettings(projection="on-demand")


def random_rotation(rng: np.random.Generator) -> Array:
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.linalg.det(Q)


def difference(function: Callable[[Array], Array], x: Array, direction: Array, step: float) -> Array:
    """Central difference of order 4 of `function` along `direction`: an error of order step^4."""
    d = step * direction
    near = function(x + d) - function(x - d)
    far = function(x + 2 * d) - function(x - 2 * d)
    return (8 * near - far) / (12 * step)


def small_bar(cells: tuple[int, int, int] = (3, 1, 1)) -> TetMesh:
    return TetMesh.box((0.75, 0.25, 0.25), cells=cells)


def left_end(mesh: TetMesh) -> NDArray[np.int32]:
    return mesh.nodes_where(lambda x: x[:, 0] <= x[:, 0].min() + 1e-9)


def right_end(mesh: TetMesh) -> NDArray[np.int32]:
    return mesh.nodes_where(lambda x: x[:, 0] >= x[:, 0].max() - 1e-9)


def boundary_nodes(mesh: TetMesh) -> NDArray[np.int32]:
    return np.unique(mesh.boundary_triangles())


def jittered(mesh: TetMesh, rng: np.random.Generator, amount: float) -> TetMesh:
    """The same mesh with its interior nodes moved by up to `amount` of its shortest edge."""
    interior = np.setdiff1d(np.arange(len(mesh.positions)), boundary_nodes(mesh))
    positions = mesh.positions.copy()
    reach = amount * mesh.edge_lengths().min()
    positions[interior] += rng.uniform(-reach, reach, size=(len(interior), 3))
    return TetMesh(positions, mesh.tets)


def make_system(
    mesh: TetMesh,
    material: StableNeoHookean | None = None,
    *,
    gravity: object = (0.0, -9.81, 0.0),
    mass: str = "lumped",
    damping: Damping | None = None,
    energies: Sequence[Energy] = (),
    held: HeldNodes | None = None,
    threads: int = 1,
) -> System:
    return System(
        mesh,
        material or StableNeoHookean(),
        gravity=gravity,  # type: ignore[arg-type]
        mass=mass,  # type: ignore[arg-type]
        damping=damping or Damping(),
        energies=energies,
        held=held or HeldNodes(len(mesh.positions)),
        threads=threads,
    )


def elastic_gradient(system: System, x: Array) -> Array:
    gradient = np.zeros_like(x)
    system.elastic.add_value_gradient(x, 1.0, gradient)
    return gradient


def elastic_hessian(system: System, x: Array, *, project: bool) -> _native.BlockMatrix:
    matrix = _native.BlockMatrix(system.pattern)
    system.elastic.add_hessian(x, 1.0, project, matrix)
    return matrix


def node_blocks(pattern: _native.BlockPattern) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of each block of the lower triangle."""
    begin = np.asarray(pattern.column_begin)
    return np.asarray(pattern.rows).astype(np.int64), np.repeat(np.arange(pattern.nodes), np.diff(begin))


def dense(matrix: _native.BlockMatrix, pattern: _native.BlockPattern) -> Array:
    """The whole symmetric matrix (3n, 3n), put together from the blocks of the lower triangle."""
    full = np.zeros((pattern.nodes, 3, pattern.nodes, 3))
    for block, i, j in zip(matrix.values, *node_blocks(pattern), strict=True):
        full[i, :, j, :] = block
        full[j, :, i, :] = block.T
    return full.reshape(3 * pattern.nodes, 3 * pattern.nodes)


def multiply(matrix: _native.BlockMatrix, x: Array) -> Array:
    out = np.empty_like(x)
    matrix.multiply(x, out)
    return out


def start_at(simulation: Simulation, positions: Array, velocities: Array | float = 0.0) -> Simulation:
    """`simulation`, which has its pins already, at time 0 with these positions and velocities."""
    v = np.ascontiguousarray(np.broadcast_to(velocities, positions.shape), dtype=np.float64)
    simulation.restore(State(0.0, np.ascontiguousarray(positions), v), 0, {})
    return simulation


def finish(simulation: Simulation, steps: int) -> State:
    """Take `steps` steps and return the last state."""
    for _ in simulation.run(steps):
        pass
    return simulation.state


def fitted_slope(steps: Array, errors: Array) -> float:
    """The order p of a least-squares fit errors = C steps^p."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def mechanical_energy(simulation: Simulation) -> float:
    """Kinetic (lumped mass), elastic and gravitational energy [J], without the last where gravity is zero."""
    system, state = simulation.system, simulation.state
    kinetic = 0.5 * float(np.sum(system.mass[:, None] * state.velocities**2))
    lift = state.positions - simulation.mesh.positions
    return kinetic + system.elastic.value(state.positions) - float(np.sum(system.gravity.forces(state.time) * lift))
