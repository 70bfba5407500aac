"""By what contacts differ from those in a factor, in NumPy: what the native `contact_change` is compared with."""

from __future__ import annotations

import numpy as np

from qlb import _native
from qlb.arrays import BoolArray, IntArray
from qlb.contact.stage import ContactPoint
from qlb.solvers import contact_base
from qlb.solvers.contact_base import SHIFTED, ContactBase
from tests.support import Array

Terms = tuple[IntArray, Array, Array]
"""A sum of k a a^T: nodes (t, 4), a at each of them (t, 4, 3), and k (t,)."""


def arrays(terms: _native.RankOneTerms) -> Terms:
    """Its parts."""
    return terms.nodes, terms.vectors, terms.stiffness


def reference_difference(
    base: ContactBase, contact: ContactPoint, inverse: _native.WoodburyInverse, scale: float
) -> tuple[Array, Terms]:
    """The stiffness of each term of `contact` beside the factor, and the terms in the frame of the factor."""
    for near in contact_base.NEAR:
        lacking, others = _at_level(base, contact, inverse, scale, near)
        if np.count_nonzero(lacking) + len(others[2]) <= contact_base.CROWD:
            break
    return lacking, others


def _at_level(
    base: ContactBase,
    contact: ContactPoint,
    inverse: _native.WoodburyInverse,
    scale: float,
    near: tuple[float, float],
) -> tuple[Array, Terms]:
    small, same = near[0] * scale, near[1]
    terms, then_terms = arrays(contact.terms()), arrays(base.terms)
    lacking, change = terms[2].copy(), -then_terms[2]
    _, here, there = np.intersect1d(contact.contacts.key, base.keys, return_indices=True)
    now, then = terms[2][here], then_terms[2][there]
    turn = _pulled_back(inverse, terms[0][here], terms[1][here]) - then_terms[1][there]
    parallel = np.maximum(now, then) * np.sum(turn**2, axis=(1, 2)) <= 0.5 * scale
    lacking[here[parallel]] = 0.0
    change[there[parallel]] = np.where(_alike(now, then, same), 0.0, now - then)[parallel]

    _, here, there = np.intersect1d(contact.sliding_keys, base.sliding, return_indices=True)
    rows = (contact.count + 2 * here)[:, None] + [0, 1]
    base_rows = (len(base.keys) + 2 * there)[:, None] + [0, 1]
    nodes, old, stiffness = (part[base_rows] for part in then_terms)
    new = _pulled_back(inverse, terms[0][rows], terms[1][rows])
    at = np.argmax(np.sum(old[:, 0] ** 2, axis=2), axis=1)
    weight = _weights(old[:, 0], at)
    kept = np.sum((weight - _weights(new[:, 0], at)) ** 2, axis=1) <= SHIFTED
    lacking[rows[kept]] = change[base_rows[kept]] = 0.0
    block, block_then = _block(new, terms[2][rows], at), _block(old, stiffness, at)
    k = np.flatnonzero(kept)
    sizes, axes = np.linalg.eigh(block[k] - block_then[k])
    side, side_then = (np.einsum("kia,kij,kja->ka", axes, b[k], axes) for b in (block, block_then))
    c, a = np.nonzero(~_alike(side, side_then, same) & (np.abs(sizes) > small))
    vectors = weight[k[c], :, None] * axes[c, :, a][:, None, :]

    lacking[lacking <= small] = change[np.abs(change) <= small] = 0.0
    held = np.flatnonzero(change)
    others = then_terms[0][held], then_terms[1][held], change[held]
    turned = nodes[k[c], 0], vectors, sizes[c, a]
    beside = [np.concatenate(parts) for parts in zip(others, turned, strict=True)]
    return lacking, (beside[0], beside[1], beside[2])


def _pulled_back(inverse: _native.WoodburyInverse, nodes: IntArray, vectors: Array) -> Array:
    out = np.empty_like(vectors)
    inverse.pull_back(np.ascontiguousarray(nodes), np.ascontiguousarray(vectors), out)
    return out


def _weights(vectors: Array, at: IntArray) -> Array:
    """What each of four nodes has of the vector of vectors (k, 4, 3) at node `at`, shape (k, 4)."""
    reference = vectors[np.arange(len(at)), at]
    return np.asarray(np.einsum("kni,ki->kn", vectors, reference) / np.sum(reference**2, axis=1)[:, None])


def _block(vectors: Array, stiffness: Array, at: IntArray) -> Array:
    """The sum of k a a^T over the two terms of each contact, vectors (k, 2, 4, 3), at node `at`; shape (k, 3, 3)."""
    a = vectors[np.arange(len(at)), :, at]
    return np.asarray(np.einsum("kt,kti,ktj->kij", stiffness, a, a))


def _alike(now: Array, then: Array, same: float) -> BoolArray:
    return np.asarray((now <= same * then) & (then <= same * now))
