"""Friction with what it lags: normal forces, directions of sliding, points of contact."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from qlb import _native
from qlb.arrays import BoolArray, FloatArray, LongArray
from qlb.contact.model import ContactModel


class LaggedFriction:
    """Coulomb friction of the contacts of an earlier configuration (Li et al. 2020, section 5)."""

    def __init__(
        self, model: ContactModel, contacts: _native.ContactSet, scale: float, plane_motion: FloatArray
    ) -> None:
        """`scale`: of the forces in `contacts`; `plane_motion`: of each plane over the stage [m], shape (q, 3)."""
        mu = model.friction[contacts.groups[:, 0], contacts.groups[:, 1]]
        slides = np.flatnonzero(mu * contacts.force > 0)
        self._slides = slides = slides[np.argsort(contacts.key[slides])]
        self._contacts, self._scale, self._mu = contacts, scale, mu[slides]
        self.keys: LongArray = contacts.key[slides]
        """of the pairs that slide, ascending"""
        self._plane = model.plane_of(contacts)[slides]
        on_plane = self._plane >= 0
        self._slip = np.zeros((len(slides), 3))
        self._slip[on_plane] = plane_motion[self._plane[on_plane]]

    @cached_property
    def whole(self) -> _native.Friction | None:
        """Friction of all contacts; None where nothing slides."""
        return self._of(np.ones(len(self._slides), dtype=bool))

    def on_plane(self, plane: int) -> _native.Friction | None:
        """Friction of the contacts with one plane alone."""
        return self._of(self._plane == plane)

    def _of(self, chosen: BoolArray) -> _native.Friction | None:
        if not chosen.any():
            return None
        contacts, slides = self._contacts, self._slides[chosen]
        return _native.Friction(
            contacts.nodes[slides],
            contacts.gamma[slides],
            contacts.normal[slides],
            contacts.force[slides] / self._scale,
            self._mu[chosen],
            self._slip[chosen],
        )
