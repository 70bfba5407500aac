"""The elastic energies of an assembly: bodies of one material model share one, over the tets of all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.bodies.assembly import Assembly


class ElasticSum:
    """The sum of several elastic energies [J]."""

    def __init__(self, parts: Sequence[_native.ElasticEnergy]) -> None:
        self.parts = tuple(parts)

    def value(self, x: FloatArray) -> float:
        """At positions `x` (n, 3) [m]."""
        return sum(part.value(x) for part in self.parts)

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        """As `Potential`."""
        return sum(part.add_value_gradient(x, scale, gradient) for part in self.parts)

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """As `Potential`."""
        for part in self.parts:
            part.add_hessian(x, scale, project, matrix)


class ElasticEnergies:
    """Makes the energies of materials and fibres.

    Attributes:
        blocks: all tets of the assembly.
        materials: one energy for each material model.
        fibres: one for each family of each body, over the tets of that body alone.
    """

    def __init__(self, assembly: Assembly, pattern: _native.BlockPattern, threads: int) -> None:
        self._assembly, self._pattern, self._threads = assembly, pattern, threads
        self._made: dict[tuple[int, ...], _native.TetBlocks] = {}
        self.blocks = self._blocks(tuple(range(len(assembly.bodies))))
        self.materials = [self._material(group) for group in _alike(assembly)]
        self.fibres = [
            _native.ElasticEnergy(
                self._blocks((b,)), family.kernels, assembly.on_body(b, family.parameter_table), threads
            )
            for b, body in enumerate(assembly.bodies)
            for family in body.fibres
        ]

    @property
    def elastic(self) -> _native.ElasticEnergy | ElasticSum:
        """All materials as one energy."""
        return self.materials[0] if len(self.materials) == 1 else ElasticSum(self.materials)

    def _material(self, bodies: tuple[int, ...]) -> _native.ElasticEnergy:
        materials, begin = self._assembly.materials, self._assembly.tet_begin
        tables = [materials[b].parameter_table(int(begin[b + 1] - begin[b])) for b in bodies]
        first = materials[bodies[0]]
        parameters = tables[0] if len(tables) == 1 else np.concatenate(tables)
        return _native.ElasticEnergy(
            self._blocks(bodies), first.kernels, parameters, self._threads, program=first.program()
        )

    def _blocks(self, bodies: tuple[int, ...]) -> _native.TetBlocks:
        """The tets of some bodies, one body after the other; made once."""
        if bodies not in self._made:
            mesh, begin = self._assembly.system_mesh, self._assembly.tet_begin
            chosen = [mesh.tets[begin[b] : begin[b + 1]] for b in bodies]
            tets = mesh.tets if len(bodies) == len(begin) - 1 else np.concatenate(chosen)
            self._made[bodies] = _native.TetBlocks(mesh.positions, tets, self._pattern)
        return self._made[bodies]


def _alike(assembly: Assembly) -> list[tuple[int, ...]]:
    """The bodies whose materials have the same kernels and program, as groups in order of their first body."""
    groups: dict[object, tuple[int, ...]] = {}
    for b, material in enumerate(assembly.materials):
        key = (material.kernels, material.program_key())
        groups[key] = (*groups.get(key, ()), b)
    return list(groups.values())
