"""What the tets are made of, as far as stress, energies and momentum need it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.analysis.strain import edges
from qlb.arrays import FloatArray
from qlb.bodies import Assembly
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.simulation import Simulation
from qlb.system.system import MassKind

CHUNK = 1 << 13
"""Tets at a time: the kernels give second derivatives, too, of 81 numbers each."""


@dataclass(frozen=True, eq=False)
class Law:
    """An energy density over some tets: that of a material, or of fibres that are added to it."""

    kernels: str
    """name of the compiled kernels"""
    begin: int
    end: int
    """the first tet, and the first behind"""
    parameters: FloatArray | None
    """of the kernels, a row for each tet or one for all; None where they are not known"""
    program: _native.Program | None = None
    """what the kernels run, for a density that is not compiled"""

    def add(self, F: FloatArray, psi: FloatArray, P: FloatArray) -> None:
        """Add energy density [Pa] (m,) and first Piola-Kirchhoff stress [Pa] (m, 3, 3) at F (m, 3, 3) of all tets."""
        if self.parameters is None:
            raise InputError(
                f"the material of tets {self.begin} to {self.end - 1} is a density of the user's own, which a run does"
                " not hold: take Snapshot.of(simulation) while it runs"
            )
        for begin in range(self.begin, self.end, CHUNK):
            tets = slice(begin, min(begin + CHUNK, self.end))
            table = self.parameters
            if len(table) > 1:
                table = table[tets.start - self.begin : tets.stop - self.begin]
            psi_, P_ = self._evaluate(F[tets], table)
            psi[tets] += psi_
            P[tets] += P_

    def _evaluate(self, F: FloatArray, table: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = len(F)
        psi, P, C = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 9, 9))
        rows = np.ascontiguousarray(np.broadcast_to(table, (count, table.shape[1])))
        _native.evaluate_density(self.kernels, np.ascontiguousarray(F), rows, False, psi, P, C, program=self.program)
        return psi, P


class Constitution:
    """Materials with their parameters, density and mass matrix of all bodies.

    Attributes:
        mesh: all bodies at rest.
        laws: densities that add up.
        density: of each tet [kg/m^3], shape (m,).
        mass: "lumped" or "consistent".
    """

    def __init__(self, mesh: TetMesh, laws: tuple[Law, ...], density: FloatArray, mass: MassKind) -> None:
        self.mesh = mesh
        self.laws = laws
        self.density: FloatArray = np.array(np.broadcast_to(density, (len(mesh.tets),)))
        self.mass: MassKind = mass

    @staticmethod
    def of(simulation: Simulation) -> Constitution:
        """That of a simulation. Raises `InputError` where a parameter does not fit."""
        whole = simulation.assembly
        density = whole.per_element(lambda material: material.density)
        return Constitution(whole.mesh, tuple(_laws(whole)), density, simulation.mass)

    @cached_property
    def volumes(self) -> FloatArray:
        """Of the tets at rest [m^3], shape (m,)."""
        return self.mesh.volumes()

    @cached_property
    def element_mass(self) -> FloatArray:
        """Of the tets [kg], shape (m,)."""
        return self.density * self.volumes

    @cached_property
    def node_mass(self) -> FloatArray:
        """What each node of the bodies carries [kg], shape (n,)."""
        share = np.repeat(0.25 * self.element_mass, 4)
        return np.bincount(self.mesh.tets.ravel(), share, len(self.mesh.positions)).astype(np.float64)

    @cached_property
    def inverse_rest(self) -> FloatArray:
        """Inverses of the edges at rest [1/m], shape (m, 3, 3)."""
        return np.asarray(np.linalg.inv(edges(self.mesh.positions, self.mesh.tets)))

    @property
    def is_known(self) -> bool:
        """Whether stress can be had: a run does not hold densities of the user's own."""
        return all(law.parameters is not None for law in self.laws)

    def evaluate(self, F: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Energy density [Pa] (m,) and first Piola-Kirchhoff stress [Pa] (m, 3, 3) at F (m, 3, 3).

        Raises:
            InputError: a material is not known (`is_known`).
        """
        psi, P = np.zeros(len(F)), np.zeros((len(F), 3, 3))
        for law in self.laws:
            law.add(F, psi, P)
        return psi, P

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """Named arrays that `from_arrays` takes; parameters of a density of the user's own are left out."""
        arrays: dict[str, npt.NDArray[Any]] = {
            "kernels": np.array([law.kernels for law in self.laws], np.str_),
            "tets": np.array([[law.begin, law.end] for law in self.laws], np.int64),
            "density": _merged(self.density),
            "mass": np.array(self.mass),
        }
        for k, law in enumerate(self.laws):
            if law.parameters is not None and law.program is None:
                arrays[f"parameters_{k}"] = law.parameters
        return arrays

    @staticmethod
    def from_arrays(mesh: TetMesh, arrays: dict[str, npt.NDArray[Any]]) -> Constitution:
        """What `arrays` gave. Raises `InputError` where it does not fit together or `mesh`."""
        m = len(mesh.tets)
        laws, mass, density = [], str(arrays["mass"]), arrays["density"]
        if mass not in ("lumped", "consistent") or len(density) not in (1, m) or not np.all(density > 0):
            raise InputError("mass or density are not what they should be")
        if len(arrays["kernels"]) != len(arrays["tets"]):
            raise InputError("kernels and tets differ in number")
        for k, (kernels, (begin, end)) in enumerate(zip(arrays["kernels"], arrays["tets"], strict=True)):
            table = arrays.get(f"parameters_{k}")
            law = Law(str(kernels), int(begin), int(end), None if table is None else np.asarray(table, np.float64))
            _require_sound(law, m)
            laws.append(law)
        return Constitution(mesh, tuple(laws), density, cast(MassKind, mass))


def _laws(whole: Assembly) -> Iterator[Law]:
    """Those of the materials, then those of the fibres, body by body."""
    begin = [int(k) for k in whole.tet_begin]
    for b, material in enumerate(whole.materials):
        table = material.parameter_table(begin[b + 1] - begin[b])
        yield Law(material.kernels, begin[b], begin[b + 1], _merged(table), material.program())
    for b, body in enumerate(whole.bodies):
        for family in body.fibres:
            table = whole.on_body(b, family.parameter_table)
            yield Law(family.kernels, begin[b], begin[b + 1], _merged(table))


def _merged(rows: FloatArray) -> FloatArray:
    """The first row alone where all are alike."""
    return rows[:1] if (rows == rows[:1]).all() else rows


def _require_sound(law: Law, tets: int) -> None:
    """Raise `InputError` unless the kernels are compiled in and take the parameters."""
    if not 0 <= law.begin < law.end <= tets:
        raise InputError(f"tets {law.begin} to {law.end} are out of range: must be in [0, {tets}]")
    if law.parameters is None:
        return
    if law.parameters.ndim != 2 or len(law.parameters) not in (1, law.end - law.begin):
        raise InputError(f"parameters of {law.kernels} have shape {law.parameters.shape}")
    try:
        law._evaluate(np.eye(3)[None], law.parameters[:1])
    except ValueError as error:
        raise InputError(f"material {law.kernels!r}: {error}") from None
