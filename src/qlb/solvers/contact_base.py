"""Contacts that are part of a factor, and how those of the moment differ from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from qlb.arrays import BoolArray, FloatArray, LongArray
from qlb.contact.stage import ContactPoint, Terms

Indices = npt.NDArray[np.integer]

SAME = 3.0  # times stiffer or softer than in the factor is near enough
SMALL = 0.3  # of the stiffness of the bodies: what is softer need not be right


@dataclass(frozen=True)
class ContactBase:
    """Terms k a a^T that a factor holds: of contacts along their normals, and of friction.

    A contact is known again by its pair of primitives, friction by where it was lagged.
    """

    keys: LongArray
    terms: Terms
    contacts: int
    """how many of the terms are contacts; the others are friction's"""

    @staticmethod
    def of(contact: ContactPoint) -> ContactBase:
        """The terms at a point."""
        return ContactBase(contact.contacts.key.copy(), contact.terms(), contact.count)

    def difference(self, contact: ContactPoint, terms: Terms, scale: float) -> tuple[FloatArray, Terms]:
        """What a model needs beside the factor.

        Args:
            contact: of the moment.
            terms: all its terms, those of `contact.terms()` first.
            scale: stiffness of the bodies, in the units of k.

        Returns:
            What of the stiffness of each of `terms` the factor lacks (t,), zero where it has that term nearly so; and
            the terms that it has too many, with negative stiffness.
        """
        lacking = terms[2].copy()
        extra = np.ones(len(self.terms[2]), dtype=bool)
        _, here, there = np.intersect1d(contact.contacts.key, self.keys, return_indices=True)
        self._cancel(terms, lacking, extra, here, there, scale)
        slides, slid = terms[0][contact.count : len(contact.terms()[2])], self.terms[0][self.contacts :]
        if np.array_equal(slides, slid):
            rows = np.arange(len(slides))
            self._cancel(terms, lacking, extra, contact.count + rows, self.contacts + rows, scale)
        nodes, vectors, stiffness = self.terms
        extra &= stiffness > SMALL * scale
        return lacking, (nodes[extra], vectors[extra], -stiffness[extra])

    def _cancel(
        self, terms: Terms, lacking: FloatArray, extra: BoolArray, here: Indices, there: Indices, scale: float
    ) -> None:
        """Take off both sides what is alike: rows `here` of `terms`, `there` of the factor's."""
        now, then = terms[2][here], self.terms[2][there]
        turned = np.sum((terms[1][here] - self.terms[1][there]) ** 2, axis=(1, 2))
        alike = (now <= SAME * then) & (then <= SAME * now) & (np.maximum(now, then) * turned <= 0.5 * scale)
        alike |= (now <= SMALL * scale) & (then <= SMALL * scale)
        lacking[here[alike]] = 0.0
        extra[there[alike]] = False
