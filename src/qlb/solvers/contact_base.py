"""Contacts that are part of a factor, and how those of the moment differ from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qlb import _native
from qlb.arrays import BoolArray, FloatArray, LongArray
from qlb.contact.stage import ContactPoint

PARTS = ("keys", "sliding", "nodes", "vectors", "stiffness")

NEAR = ((0.03, 2.0), (0.05, 4.0), (0.1, 8.0))
"""What is near enough in stiffness: a difference of this part of the stiffness of the bodies, or so many times more or
less. From fine to coarse: the coarser, the fewer terms are left, and the more iterations a solve takes."""

CROWD = 600  # terms that may be left: with more the next of these counts, and after the last a new factor is made
SHIFTED = 0.03  # squared change of the weights of a contact's nodes, from which on it is another contact


@dataclass(frozen=True)
class ContactBase:
    """Terms k a a^T that a factor holds: of contacts along their normals, then of friction, two a contact.

    A contact is known again by its pair of primitives. As the factor is carried along with the material, so are they:
    what they are compared with is brought into the frame of the factor.
    """

    keys: LongArray
    """of contacts, ascending"""
    sliding: LongArray
    """of the contacts that friction is of, ascending"""
    terms: _native.RankOneTerms
    """in the frame of the factor; k = 0 for those that it does not hold"""

    @staticmethod
    def of(contact: ContactPoint, held: BoolArray) -> ContactBase:
        """Those of the terms at a point that are `held` (t,)."""
        found, keys = contact.terms(), contact.contacts.key
        order = np.arange(found.size)
        order[: contact.count] = np.argsort(keys)
        stiffness = np.where(held, found.stiffness, 0.0)[order]
        terms = _native.RankOneTerms(found.nodes[order], found.vectors[order], stiffness)
        return ContactBase(np.sort(keys), contact.sliding_keys.copy(), terms)

    @property
    def held(self) -> _native.RankOneTerms:
        """The terms that the factor holds."""
        terms, rows = self.terms, np.flatnonzero(self.terms.stiffness)
        return _native.RankOneTerms(terms.nodes[rows], terms.vectors[rows], terms.stiffness[rows])

    def save(self) -> dict[str, FloatArray]:
        """As arrays of floats."""
        terms = self.terms.nodes, self.terms.vectors, self.terms.stiffness
        parts = (self.keys.view(np.float64), self.sliding.view(np.float64), *terms)
        return {f"base_{name}": np.asarray(part, dtype=np.float64) for name, part in zip(PARTS, parts, strict=True)}

    @staticmethod
    def load(arrays: dict[str, FloatArray]) -> ContactBase:
        """From what `save` gave."""
        keys, sliding, nodes, vectors, stiffness = (arrays[f"base_{name}"] for name in PARTS)
        terms = _native.RankOneTerms(nodes.astype(np.int32), vectors, stiffness)
        return ContactBase(keys.view(np.int64), sliding.view(np.int64), terms)

    def difference(
        self, contact: ContactPoint, terms: _native.RankOneTerms, inverse: _native.WoodburyInverse, scale: float
    ) -> tuple[_native.RankOneTerms, int]:
        """What a model needs beside the factor.

        Along nearly the same normal only the change of stiffness counts; of friction, whose two terms turn with the
        slip, the eigenvectors of the change of the 3x3 block that they make at one node. Where they are a crowd, what
        differs least is left to the pairs of L-BFGS.

        Args:
            contact: of the moment.
            terms: all its terms, those of `contact.terms()` first.
            inverse: that the factor is part of.
            scale: stiffness of the bodies, in the units of k.

        Returns:
            `terms` with the stiffness that goes beside the factor, zero where the factor or the other terms have it,
            and after them these others, negative where the factor has too much; and how many these are. They are in
            the frame of the factor.
        """
        now, held = (terms, contact.contacts.key, contact.sliding_keys), (self.terms, self.keys, self.sliding)
        return _native.contact_change(*now, *held, inverse, scale, SHIFTED, NEAR, CROWD)
