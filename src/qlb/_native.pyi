"""
Compiled kernels of qlb. Use the package `qlb`; this module has no stable interface.
"""

from collections.abc import Sequence
from typing import Annotated, Any, overload

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

    def holds(self, stencils: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu')]) -> None:
        """
        Whether all blocks between the nodes of each stencil, shape (k, 4), are there: 0 or 1, shape (k,).
        """

    @property
    def column_begin(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), writable=False)]: ...

    @property
    def rows(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None,), writable=False)]: ...

class PatternMap:
    """Where the blocks of a pattern stand in a larger one of the same nodes."""

    def __init__(self, inner: BlockPattern, outer: BlockPattern) -> None: ...

class BlockMatrix:
    """Symmetric matrix of 3x3 node blocks over a BlockPattern."""

    def __init__(self, arg: BlockPattern, /) -> None: ...

    @property
    def values(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]: ...

    def set_zero(self, threads: int) -> None: ...

    def shift_diagonal(self, amount: float) -> None: ...

    def add_stencils(self, nodes: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], blocks: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> None:
        """
        Adds symmetric matrices, shape (k, 12, 12), between the nodes of stencils, shape (k, 4); repeated nodes add up.
        """

    def add_rank_one(self, terms: RankOneTerms, left_out: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)]) -> None:
        """
        Adds the sum of the terms; vectors at nodes that are `left_out`, shape (n,), count as zero.
        """

    def set_from(self, map: PatternMap, other: BlockMatrix) -> None:
        """
        Takes the values of a matrix over the inner pattern of the map; zero elsewhere.
        """

    def multiply(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

class RankOneTerms:
    """
    A sum of matrices stiffness a a^T, a with a vector at each node of a term.
    """

    @overload
    def __init__(self, nodes: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], gamma: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], axis: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], stiffness: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> None:
        """
        a = gamma (x) axis: shapes (k, 4), (k, 4), (k, 3), (k,). A node that a term repeats adds up.
        """

    @overload
    def __init__(self, nodes: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], vectors: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], stiffness: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> None:
        """Shapes (k, 4), (k, 4, 3), (k,)."""

    @property
    def size(self) -> int: ...

    @property
    def nodes(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 4), writable=False)]: ...

    @property
    def vectors(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 4, 3), writable=False)]: ...

    @property
    def stiffness(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    def __len__(self) -> int: ...

    def add_combination(self, beta: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """out += C beta, shapes (k,) and (n, 3)."""

    def add_product(self, v: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], scale: float = 1.0, stiffness: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        out += scale C K C^T v, both of shape (n, 3); K their own stiffness, or one given (k,).
        """

class ContactSurface:
    """The triangles that may touch, and which bodies may touch which."""

    def __init__(self, rest: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], faces: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], group: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], allowed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def faces(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 3), writable=False)]: ...

    @property
    def edges(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 2), writable=False)]: ...

    @property
    def vertices(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None,), writable=False)]: ...

    def node_area(self, node: int) -> float: ...

    def edge_area(self, edge: int) -> float: ...

def plane_bound(vertices: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], near: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], motion: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], share: float) -> tuple[float, int, int]:
    """
    The largest part of a step p (n, 3) [m] from x, at most 1, that takes no more than `share` of any gap between vertices (v) and planes, normals (q, 3), offsets (q), that hold them out (near (v, q)) and whose offsets grow by motion (q) [m] at the same time; and the node and the plane that bound it, -1 where none does.
    """

class ContactSet:
    """
    The contacts of one configuration, one entry of each array per contact.
    """

    @property
    def energy(self) -> float:
        """scaled; infinite where something touches"""

    @property
    def minimum_distance(self) -> float:
        """[m]; infinite where there is no contact"""

    @property
    def size(self) -> int: ...

    @property
    def nodes(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 4), writable=False)]: ...

    @property
    def gamma(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 4), writable=False)]: ...

    @property
    def normal(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 3), writable=False)]: ...

    @property
    def distance(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    @property
    def force(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    @property
    def stiffness(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    @property
    def dhat(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    @property
    def key(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), writable=False)]: ...

    @property
    def groups(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 2), writable=False)]: ...

class Barrier:
    """
    The potential of contact: a barrier, or a penalty where states may intersect.
    """

    def __init__(self, surface: ContactSurface, dhat: float, stiffness: float, threads: int, kind: str = 'barrier') -> None: ...

    def limit_pairs(self, keys: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], dhat: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> None:
        """Pairs that act only when nearer than a distance of their own."""

    @property
    def reach(self) -> float:
        """Pairs farther apart, or for a penalty deeper inside, do not act [m]."""

    def evaluate(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], vertex_faces: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], edge_edges: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], planes: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], plane_allowed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], edge_sign: Annotated[NDArray[numpy.int8], dict(order='C', device='cpu', writable=False)] | None = None) -> ContactSet:
        """
        The contacts at x (n, 3) [m] among the pairs vertex_faces (k, 2) [node, face] and edge_edges (l, 2) and between all vertices and the planes (q, 4) [unit normal, offset] that hold out their groups (plane_allowed (q, groups)). Adds scale times the gradient of the energy to gradient (n, 3). edge_sign (l) int8, for a penalty: -1 where two edges have passed through each other.
        """

    def bending(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], contacts: ContactSet, threshold: float) -> RankOneTerms:
        """
        Terms of the Hessian of contacts besides the normal ones, as far as they stiffen by more than `threshold`.
        """

    def hessian_blocks(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], contacts: ContactSet, project: bool) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 12, 12))]:
        """
        The Hessian of each contact (size, 12, 12) at the x where `contacts` were found, scaled as they are. project: to the nearest positive semidefinite matrices.
        """

class FrictionTerms:
    """Friction's energy and its Hessian, two rank-one terms a contact."""

    @property
    def energy(self) -> float: ...

    @property
    def nodes(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 4), writable=False)]: ...

    @property
    def gamma(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 4), writable=False)]: ...

    @property
    def axis(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 3), writable=False)]: ...

    @property
    def stiffness(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]: ...

    @property
    def slip(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 3), writable=False)]: ...

    def secant(self, before: FrictionTerms) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """
        By how much each friction has grown along the change of its slip since `before`, over that change (k,); 0 where that is none.
        """

class Friction:
    """Smooth Coulomb friction with lagged normal forces."""

    def __init__(self, nodes: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], gamma: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], normal: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], normal_force: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], mu: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], slip: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)] | None = None) -> None: ...

    @property
    def size(self) -> int: ...

    def evaluate(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], x_base: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], epsilon: float, scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> FrictionTerms:
        """
        The friction of slips from x_base to x (n, 3) [m]; below the slip epsilon [m] it holds. Adds scale times the gradient of the energy to gradient (n, 3).
        """

def contact_terms(contacts: ContactSet | None, friction: FrictionTerms | None, along: float, secant: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)] | None = None, more: RankOneTerms | None = None) -> RankOneTerms:
    """
    The Hessian of contacts along their normals, then that of friction, two terms each, then `more`. Along its slip friction has at least the share `along` of its stiffness across, and at least `secant` (f), no more than across.
    """

class Candidates:
    """
    Pairs of primitives of a ContactSurface that may come near each other: the broad phase, kept while the surface stays in the boxes it was built for, and collision detection on it.
    """

    def __init__(self, surface: ContactSurface, threads: int) -> None: ...

    def build(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], margin: float, radius: float) -> None:
        """
        Lists the pairs that may come within radius [m] of each other while every vertex stays within margin [m], by coordinate, of the box of its path x -> x + p, both (n, 3) [m]. Clamp p first: a long one lists all.
        """

    def covers(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> bool:
        """Whether the lists are complete along all of x -> x + p."""

    @property
    def vertex_faces(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 2), writable=False)]:
        """Node and face of each pair, shape (k, 2), a copy."""

    @property
    def edge_edges(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 2), writable=False)]:
        """Edges of each pair, the lower number first, shape (l, 2), a copy."""

    def step_bound(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> float:
        """
        The largest step in (0, 1] found for which every listed pair keeps at least the fraction `slack` of its distance at x all along x + step p. 0 only if a pair touches at x. True of all pairs where covers(x, p).
        """

    @property
    def limiting(self) -> object:
        """
        Nodes (4,) of the pair that bounded the last step_bound, None if that was 1.
        """

    @property
    def slack(self) -> float:
        """Fraction of its distance that a pair keeps in a step, between 0 and 1."""

    @slack.setter
    def slack(self, arg: float, /) -> None: ...

    def minimum_distance(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> float:
        """
        Least distance [m] of the listed pairs at x; infinite if none is listed.
        """

    def near(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], radius: float) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 4), writable=False)]:
        """
        Nodes of the listed pairs that are nearer than radius [m] at x (n, 3) [m], shape (k, 4), a copy.
        """

    def intersections(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.int32], dict(shape=(None, 2), writable=False)]:
        """
        Edge and face of each pair that cross or touch at x, shape (k, 2). Changes no list of candidates.
        """

class Program:
    """
    A density of the invariants as lists of operations: for psi; for psi, d1, d2, dJ; for all derivatives. A list is
    (operations (k), registers (k, 4): target and operands, constants, outputs). Raises ValueError for a wrong one.
    """

    def __init__(self, parameter_count: int, energy: tuple[Any, ...], slopes: tuple[Any, ...], derivatives: tuple[Any, ...]) -> None: ...

def program_operations() -> list[tuple[str, int]]:
    """Name and number of operands of each operation, in their order."""

MAX_REGISTERS: int = 128

MAX_OPERATIONS: int = 4096

class TetBlocks:
    """Linear tetrahedra laid out for SIMD and threads."""

    def __init__(self, rest_positions: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], tets: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], pattern: BlockPattern) -> None: ...

class TetGeometry:
    """What a deformation is like, without any material."""

    def __init__(self, blocks: TetBlocks, threads: int) -> None: ...

    def least_J(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> float: ...

    def nodal_maps(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], reference: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], weight: float, maps: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

class ElasticEnergy:
    def __init__(self, blocks: TetBlocks, material: str, parameters: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], threads: int, simd_level: str = '', program: Program | None = None) -> None: ...

    def value(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> float: ...

    def add_value_gradient(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float: ...

    def add_viscous_value_gradient(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], viscosity: ElasticEnergy, scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float:
        """
        add_value_gradient of the sum of this and the viscosity of the same elements, in one loop over them.
        """

    def add_hessian(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, project: bool, matrix: BlockMatrix) -> None: ...

class Viscosity(ElasticEnergy):
    """Kelvin-Voigt viscosity as a potential of one stage."""

    def __init__(self, blocks: TetBlocks, eta: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], threads: int) -> None: ...

    def clear_base(self, c: float) -> None: ...

    def add_base(self, weight: float, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> None: ...

class Inertia:
    def __init__(self, row_begin: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], columns: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], pattern: BlockPattern, threads: int) -> None: ...

    def add_value_gradient(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], target: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], scale: float, gradient: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> float: ...

    def add_hessian(self, scale: float, matrix: BlockMatrix) -> None: ...

def evaluate_density(material: str, F: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], parameters: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], project: bool, energy: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], stress: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], stiffness: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], simd_level: str = '', program: Program | None = None) -> None: ...

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

openblas_version: str = ...

cholmod_version: str = '3.0.14'

class CarriedInverse(InverseOperator):
    """An inverse carried along with the material."""

    def __init__(self, inner: InverseOperator, blocks: TetBlocks, fixed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], threads: int) -> None: ...

    def carry(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], reference: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], weight: float) -> None: ...

    def reset(self) -> None: ...

class SupernodalCholesky(Cholesky):
    def __init__(self, pattern: BlockPattern, fixed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], threads: int, precision: str, simd: str = '', order: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        order: all nodes, shape (n,), in the order of elimination; without it nested dissection (METIS) finds one.
        """

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
    def node_order(self) -> Annotated[NDArray[numpy.int32], dict(shape=(None,))]:
        """
        Order of all nodes, shape (n,), that the analysis started from: an extended pattern may reuse it.
        """

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

    def set_precision(self, precision: str) -> None:
        """Go on in another precision; the factor in place is lost."""

    @property
    def precision(self) -> str: ...

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

    def direction_with(self, g: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], inner: InverseOperator, terms: RankOneTerms, p: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')], beta: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)] | None = None, known: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)] | None = None) -> float:
        """
        As direction, for the gradient g + C beta, with y + C K C^T s in place of y in each pair, for terms C K C^T that the pairs leave out and `inner` takes in.
        """

def dot(a: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], threads: int) -> float: ...

class WoodburyInverse(InverseOperator):
    """
    An inverse carried along with the material, with rank-one terms added to the matrix.
    """

    def __init__(self, factor: InverseOperator, blocks: TetBlocks, fixed: Annotated[NDArray[numpy.uint8], dict(order='C', device='cpu', writable=False)], threads: int) -> None: ...

    def carry(self, x: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], reference: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], weight: float) -> None:
        """
        Maps from how the material has moved since the factor was made at `reference`; the terms stay.
        """

    def reset(self) -> None:
        """Maps of one; the terms stay."""

    def set_terms(self, terms: RankOneTerms, framed: int = 0) -> bool:
        """
        Replaces the terms; the last `framed` of them are in the frame of the factor as they are. False where the sum is not positive definite: it then goes on without any.
        """

    def pull_back(self, nodes: Annotated[NDArray[numpy.int32], dict(order='C', device='cpu', writable=False)], vectors: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """
        out = vectors at their nodes in the frame of the factor; shapes (k, 4, 3), nodes (k, 4).
        """

    def forget(self) -> None:
        """
        Drops the terms and the half-solves kept: for when the factor is made anew.
        """

    @property
    def terms(self) -> int: ...

    @property
    def active_terms(self) -> int:
        """Terms with a node that is free."""

    @property
    def columns(self) -> int:
        """Nodes whose half-solves are kept."""

    @property
    def bytes(self) -> int:
        """Memory of the half-solves and their products."""

def contact_change(now: RankOneTerms, keys: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], sliding: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], held: RankOneTerms, held_keys: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], held_sliding: Annotated[NDArray[numpy.int64], dict(order='C', device='cpu', writable=False)], inverse: WoodburyInverse, scale: float, shifted: float, levels: Sequence[tuple[float, float]], most: int) -> tuple[RankOneTerms, int]:
    """
    What a model needs beside a factor that holds other contacts. now, held: terms, k along normals, 2 f of friction, any others; keys (k), sliding (f): their pairs of primitives; `held` is in the frame of the factor, ascending by them. Gives the terms of now with the stiffness that goes beside the factor, after them others in the frame of the factor, and how many of these.
    """

def simd_levels() -> list[str]:
    """SIMD levels this build and this machine can run, the one in use last"""

def material_names() -> list[str]: ...

def libraries() -> dict[str, str]: ...
