"""Contacts that are part of a factor, and how those of the moment differ from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import BoolArray, FloatArray, IntArray, LongArray
from qlb.contact.stage import ContactPoint, Terms, joined

PARTS = ("keys", "sliding", "nodes", "vectors", "stiffness")
Indices = npt.NDArray[np.integer]


SAME = 2.0  # times stiffer or softer than in the factor is near enough
SMALL = 0.1  # of the stiffness of the bodies: what is softer need not be right
SHIFTED = 0.01  # squared change of the weights of a contact's nodes, from which on it is another contact


@dataclass(frozen=True)
class ContactBase:
    """Terms k a a^T that a factor holds: of contacts along their normals, then of friction, two a contact.

    A contact is known again by its pair of primitives. As the factor is carried along with the material, so are they:
    what they are compared with is brought into the frame of the factor.
    """

    keys: LongArray
    """of contacts"""
    sliding: LongArray
    """of the contacts that friction is of"""
    terms: Terms
    """in the frame of the factor; k = 0 for those that it does not hold"""

    @staticmethod
    def of(contact: ContactPoint, held: BoolArray) -> ContactBase:
        """Those of the terms at a point that are `held` (t,)."""
        nodes, vectors, stiffness = contact.terms()
        terms = nodes, vectors, np.where(held, stiffness, 0.0)
        return ContactBase(contact.contacts.key.copy(), contact.sliding_keys.copy(), terms)

    @property
    def held(self) -> Terms:
        """The terms that the factor holds."""
        rows = np.flatnonzero(self.terms[2])
        return self.terms[0][rows], self.terms[1][rows], self.terms[2][rows]

    def save(self) -> dict[str, FloatArray]:
        """As arrays of floats."""
        parts = (self.keys.view(np.float64), self.sliding.view(np.float64), *self.terms)
        return {f"base_{name}": np.asarray(part, dtype=np.float64) for name, part in zip(PARTS, parts, strict=True)}

    @staticmethod
    def load(arrays: dict[str, FloatArray]) -> ContactBase:
        """From what `save` gave."""
        keys, sliding, nodes, vectors, stiffness = (arrays[f"base_{name}"] for name in PARTS)
        terms = nodes.astype(np.int32), vectors, stiffness
        return ContactBase(keys.view(np.int64), sliding.view(np.int64), terms)

    def difference(
        self, contact: ContactPoint, terms: Terms, inverse: _native.WoodburyInverse, scale: float
    ) -> tuple[FloatArray, Terms]:
        """What a model needs beside the factor.

        Args:
            contact: of the moment.
            terms: all its terms, those of `contact.terms()` first.
            inverse: that the factor is part of.
            scale: stiffness of the bodies, in the units of k.

        Returns:
            The stiffness of each of `terms` that goes beside the factor (t,), zero where the factor or the other terms
            have it; and these others, in the frame of the factor, negative where it has too much.
        """
        lacking, change = terms[2].copy(), -self.terms[2]
        _, here, there = np.intersect1d(contact.contacts.key, self.keys, return_indices=True)
        self._compare_normals(terms, lacking, change, here, there, inverse, scale)
        _, here, there = np.intersect1d(contact.sliding_keys, self.sliding, return_indices=True)
        sliding = self._compare_sliding(terms, lacking, change, contact.count, here, there, inverse, scale)
        nodes, vectors, _ = self.terms
        change[np.abs(change) <= SMALL * scale] = 0.0
        rows = np.flatnonzero(change)
        return lacking, joined((nodes[rows], vectors[rows], change[rows]), sliding)

    def _compare_normals(
        self,
        terms: Terms,
        lacking: FloatArray,
        change: FloatArray,
        here: Indices,
        there: Indices,
        inverse: _native.WoodburyInverse,
        scale: float,
    ) -> None:
        """Rows `here` of `terms` with `there` of the factor's: along nearly the same normal only the change counts."""
        now, then = terms[2][here], self.terms[2][there]
        turn = pulled_back(inverse, terms[0][here], terms[1][here]) - self.terms[1][there]
        parallel = np.maximum(now, then) * np.sum(turn**2, axis=(1, 2)) <= 0.5 * scale
        lacking[here[parallel]] = 0.0
        change[there[parallel]] = np.where(_alike(now, then, scale), 0.0, now - then)[parallel]

    def _compare_sliding(
        self,
        terms: Terms,
        lacking: FloatArray,
        change: FloatArray,
        first: int,
        here: Indices,
        there: Indices,
        inverse: _native.WoodburyInverse,
        scale: float,
    ) -> Terms:
        """The same for friction, from row `first` of `terms` on: what differs, by eigenvectors.

        Its two terms turn with the slip; compared are the 3x3 blocks that they make at one node of each contact.
        """
        rows = (first + 2 * here)[:, None] + [0, 1]
        base_rows = (len(self.keys) + 2 * there)[:, None] + [0, 1]
        nodes, old, held = (part[base_rows] for part in self.terms)
        new = pulled_back(inverse, terms[0][rows], terms[1][rows])
        at = np.argmax(np.sum(old[:, 0] ** 2, axis=2), axis=1)
        weight, weight_now = _weights(old[:, 0], at), _weights(new[:, 0], at)
        same = np.sum((weight - weight_now) ** 2, axis=1) <= SHIFTED
        lacking[rows[same]] = 0.0
        change[base_rows[same]] = 0.0
        now, then = _block(new, terms[2][rows], at), _block(old, held, at)
        k = np.flatnonzero(same & (np.abs(now - then).max(axis=(1, 2)) > SMALL * scale))
        sizes, axes = np.linalg.eigh(now[k] - then[k])
        side, side_then = (np.einsum("kia,kij,kja->ka", axes, block[k], axes) for block in (now, then))
        c, a = np.nonzero(~_alike(side, side_then, scale) & (np.abs(sizes) > SMALL * scale))
        vectors = weight[k[c], :, None] * axes[c, :, a][:, None, :]
        return nodes[k[c], 0], vectors, sizes[c, a]


def pulled_back(inverse: _native.WoodburyInverse, nodes: IntArray, vectors: FloatArray) -> FloatArray:
    """`vectors` (..., 4, 3) at their nodes (..., 4) in the frame of the factor."""
    out = np.empty_like(vectors)
    inverse.pull_back(np.ascontiguousarray(nodes), np.ascontiguousarray(vectors), out)
    return out


def _weights(vectors: FloatArray, at: IntArray) -> FloatArray:
    """What each of four nodes has of the vector of vectors (k, 4, 3) at node `at`, shape (k, 4); inf where it is 0."""
    reference = vectors[np.arange(len(at)), at]
    length, along = np.sum(reference**2, axis=1)[:, None], np.einsum("kni,ki->kn", vectors, reference)
    return np.asarray(np.divide(along, length, out=np.full_like(along, np.inf), where=length > 0))


def _block(vectors: FloatArray, stiffness: FloatArray, at: IntArray) -> FloatArray:
    """The sum of k a a^T over the two terms of each contact, vectors (k, 2, 4, 3), at node `at`; shape (k, 3, 3)."""
    a = vectors[np.arange(len(at)), :, at]
    return np.asarray(np.einsum("kt,kti,ktj->kij", stiffness, a, a))


def _alike(now: FloatArray, then: FloatArray, scale: float) -> BoolArray:
    return np.asarray(
        ((now <= SAME * then) & (then <= SAME * now)) | ((now <= SMALL * scale) & (then <= SMALL * scale))
    )
