"""The Hessian with contact in it: a pattern that grows with the pairs that touch."""

from __future__ import annotations

import numpy as np

from qlb import _native
from qlb.arrays import BoolArray, FloatArray, IntArray
from qlb.contact.stage import ContactPoint
from qlb.system import System
from qlb.system.system import CholeskyKind, Precision

REORDER = 0.02
"""Part of the nodes in contact from which on the order of elimination of the bodies alone is no longer good enough."""

SOON = 3.0
"""Times dhat: pairs nearer than that are counted in when the pattern is extended, so that it lasts."""


class ContactMatrix:
    """Elastic Hessian plus that of contacts, and a Cholesky analysed for their common pattern.

    Contacts with planes and obstacles fit into the pattern of the bodies. For others it is extended, and kept until a
    pair appears that it lacks.
    """

    def __init__(self, system: System, kind: CholeskyKind, cholesky: _native.Cholesky) -> None:
        """`cholesky`: analysed for the pattern of the bodies; its precision is that of all that follow."""
        self._system, self._kind = system, kind
        self.cholesky = cholesky
        self._order = cholesky.node_order if isinstance(cholesky, _native.SupernodalCholesky) else None
        self._pattern = system.pattern
        self._stencils: IntArray = np.empty((0, 4), dtype=np.int32)
        self._map = _native.PatternMap(system.pattern, system.pattern)
        self._matrix = _native.BlockMatrix(system.pattern)
        self._scripted = (system.held.fixed != 0).all(axis=1).astype(np.uint8)

    def assemble(
        self, elastic: _native.BlockMatrix, contact: ContactPoint | _native.RankOneTerms, x: FloatArray
    ) -> _native.BlockMatrix:
        """`elastic` plus the projected Hessian of `contact` at `x` (n, 3) [m], or given terms; belongs to this object.

        `cholesky` is another one afterwards where the pattern had to be extended.
        """
        if isinstance(contact, _native.RankOneTerms):
            terms, stencils, blocks = contact, np.empty((0, 4), dtype=np.int32), np.empty((0, 12, 12))
        else:  # friction is of contacts that were, which need not be contacts now
            terms, (stencils, blocks) = contact.sliding_terms(), self._blocks(contact, x)
        nodes = np.concatenate([stencils, self._onto_free(terms.nodes)])
        if not self._holds(nodes).all():
            self._extend(nodes, x)
        self._matrix.set_from(self._map, elastic)
        self._matrix.add_stencils(stencils, blocks)
        self._matrix.add_rank_one(terms, self._scripted)
        return self._matrix

    def _blocks(self, contact: ContactPoint, x: FloatArray) -> tuple[IntArray, FloatArray]:
        """Free stencils (k, 4) of contacts without friction, and their blocks (k, 12, 12), zero at scripted nodes."""
        model, nodes = self._system.contact, contact.contacts.nodes
        assert model is not None
        blocks = model.barrier.hessian_blocks(x, contact.contacts, True)
        keep = np.repeat(self._scripted[nodes] == 0, 3, axis=1)
        return self._onto_free(nodes), blocks if keep.all() else blocks * (keep[:, :, None] & keep[:, None, :])

    def _onto_free(self, nodes: IntArray) -> IntArray:
        """Stencils in which nodes that are wholly scripted give way to another of the stencil."""
        scripted = self._scripted[nodes] != 0
        if not scripted.any():
            return nodes
        first_free = np.argmin(scripted, axis=1)
        return np.ascontiguousarray(np.where(scripted, nodes[np.arange(len(nodes)), first_free][:, None], nodes))

    def _holds(self, nodes: IntArray) -> BoolArray:
        """Which of the stencils (k, 4) the pattern has all blocks of."""
        found = np.empty(len(nodes), dtype=np.uint8)
        self._pattern.holds(nodes, found)
        return np.asarray(found != 0)

    def fits(self, nodes: IntArray) -> BoolArray:
        """Which of the stencils (k, 4) need no extension."""
        return self._holds(self._onto_free(nodes))

    @property
    def stencils(self) -> IntArray:
        """Contacts that the pattern is extended for, shape (k, 4)."""
        return self._stencils

    def _extend(self, nodes: IntArray, x: FloatArray) -> None:
        """Analyse anew, for the contacts of now and for pairs so near that they are likely to touch soon."""
        model = self._system.contact
        assert model is not None
        soon = self._onto_free(model.candidates.near(x, SOON * model.dhat))
        self.analyse(np.unique(np.concatenate([nodes, soon]), axis=0))

    def analyse(self, stencils: IntArray) -> None:
        """Extend the pattern of the bodies for `stencils` (k, 4), distinct and ascending."""
        system, self._stencils = self._system, stencils
        self._pattern = system.extended_pattern(self._stencils)
        touching = len(np.unique(self._stencils))
        order = self._order if touching < REORDER * system.nodes else None
        precision: Precision = getattr(self.cholesky, "precision", "float64")
        self.cholesky = system.analyse(self._kind, precision, pattern=self._pattern, order=order)
        self._map = _native.PatternMap(system.pattern, self._pattern)
        self._matrix = _native.BlockMatrix(self._pattern)
