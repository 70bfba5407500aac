"""
Compiled kernels of qlb. Use the package `qlb`; this module has no stable interface.
"""

from typing import Annotated

import numpy
from numpy.typing import NDArray


class BlockPattern:
    """
    Sparsity of the Hessian: the lower triangle of 3x3 node blocks, by columns.
    """

    def __init__(self, nodes: int, cliques: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def nodes(self) -> int: ...

    @property
    def blocks(self) -> int: ...

    @property
    def column_begin(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), writable=False)]: ...

    @property
    def rows(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None,), writable=False)]: ...

class BlockMatrix:
    """Symmetric matrix of 3x3 node blocks over a BlockPattern."""

    def __init__(self, arg: BlockPattern, /) -> None: ...

    @property
    def values(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]: ...

    def set_zero(self, threads: int) -> None: ...

    def shift_diagonal(self, amount: float) -> None: ...

    def multiply(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

class TetBlocks:
    """Linear tetrahedra laid out for SIMD and threads."""

    def __init__(self, rest_positions: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], tets: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], pattern: BlockPattern) -> None: ...

class ElasticEnergy:
    def __init__(self, blocks: TetBlocks, material: str, parameters: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], threads: int, simd_level: str = '') -> None: ...

    def value(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> float: ...

    def add_value_gradient(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float: ...

    def add_hessian(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, project: bool, matrix: BlockMatrix) -> None: ...

class Inertia:
    def __init__(self, row_begin: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], columns: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], pattern: BlockPattern, threads: int) -> None: ...

    def add_value_gradient(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], target: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float: ...

    def add_hessian(self, scale: float, matrix: BlockMatrix) -> None: ...

def evaluate_density(material: str, F: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], parameters: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], project: bool, energy: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], stress: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], stiffness: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], simd_level: str = '') -> None: ...

class InverseOperator:
    """x = B^-1 b for a symmetric positive definite B."""

    def apply(self, b: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

class Cholesky(InverseOperator):
    """Sparse Cholesky factor: analysed once, factorised many times."""

    def factorise(self, matrix: BlockMatrix) -> int:
        """
        Factorises; returns -1, or the degree of freedom (3 node + axis) whose pivot is not positive.
        """

    @property
    def factor_nonzeros(self) -> int: ...

    @property
    def factor_flops(self) -> float: ...

class CholmodCholesky(Cholesky):
    def __init__(self, pattern: BlockPattern, fixed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], threads: int) -> None: ...

class SupernodalCholesky(Cholesky):
    def __init__(self, pattern: BlockPattern, fixed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], threads: int, precision: str, simd: str = '') -> None: ...

    def solve(self, b: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """
        Several right-hand sides, one after the other in b and x: shape (count, nodes, 3).
        """

    @property
    def rows(self) -> int:
        """Free degrees of freedom."""

    @property
    def order(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]:
        """Degree of freedom of each row in elimination order."""

    @property
    def bytes(self) -> int:
        """Memory of L."""

    @property
    def solve_bytes(self) -> int:
        """Bytes of L that one solve reads."""

    def forward(self, b: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], y: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """y = L^-1 P b, y in elimination order."""

    def backward(self, y: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """x = P^T L^-T y, y in elimination order."""

    def forward_sparse(self, dofs: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> tuple[Annotated[NDArray[numpy.int64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """
        (rows, values) of y = L^-1 P b, for b zero but at `dofs`; rows in elimination order, ascending.
        """

class Lbfgs:
    """
    Limited-memory BFGS around an inner inverse (Nocedal, Wright 2006, algorithm 7.4).
    """

    def __init__(self, size: int, window: int, threads: int) -> None: ...

    @property
    def pairs(self) -> int: ...

    def clear(self) -> None: ...

    def push(self, x_old: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], g_old: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], g: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> bool: ...

    def direction(self, g: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], inner: InverseOperator, p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float: ...

def dot(a: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], threads: int) -> float: ...

def simd_levels() -> list[str]:
    """SIMD levels this build and this machine can run, the one in use last"""

def material_names() -> list[str]: ...

def libraries() -> dict[str, str]: ...
