"""A volume that is kept as a whole: a soft block without Poisson's ratio, squeezed, with and without a constraint."""

from typing import Any

import numpy as np
import scipy.sparse as sp

import qlb


class KeepVolume(qlb.NodalEnergy):
    """Phi = k/2 (V - V_0)^2/V_0, V the volume within the surface."""

    def __init__(self, mesh: qlb.TetMesh, stiffness: float) -> None:
        self.faces, self.stiffness = mesh.boundary_triangles(), stiffness
        self.surface = np.unique(self.faces)
        self.couplings = self.surface[None]  # every node of the surface with every other
        self.volume = self.volume_of(mesh.positions)

    def volume_of(self, x: np.ndarray) -> float:
        """[m^3], by the divergence theorem."""
        a, b, c = x[self.faces].transpose(1, 0, 2)
        return float(np.sum(a * np.cross(b, c)) / 6)

    def area_vectors(self, x: np.ndarray) -> np.ndarray:
        """dV/dx [m^2], shape (n, 3)."""
        a, b, c = x[self.faces].transpose(1, 0, 2)
        vectors = np.zeros_like(x)
        np.add.at(vectors, self.faces, (np.cross(b - a, c - a) / 6)[:, None])
        return vectors

    def value(self, x: np.ndarray, time: float) -> float:
        """[J]"""
        return 0.5 * self.stiffness / self.volume * (self.volume_of(x) - self.volume) ** 2

    def gradient(self, x: np.ndarray, time: float) -> np.ndarray:
        """[N], shape (n, 3)."""
        return self.stiffness / self.volume * (self.volume_of(x) - self.volume) * self.area_vectors(x)

    def hessian(self, x: np.ndarray, time: float, project: bool) -> Any:
        """[N/m]; of rank one: the part with d2V/dx2, which vanishes where V = V_0, is left out."""
        g = sp.csr_matrix(self.area_vectors(x).reshape(-1, 1))
        return self.stiffness / self.volume * (g @ g.T)


def main() -> None:
    """Squeeze a block to 0.7 of its height and print its volume."""
    mesh = qlb.TetMesh.box((0.4, 0.4, 0.4), cells=(4, 4, 4))
    for stiffness in (0.0, 1e6):
        sim = qlb.Simulation(mesh, material=qlb.StableNeoHookean(young=1e4, poisson=0.0), integrator="quasistatic")
        sim.pin(mesh.nodes_where(lambda x: x[:, 1] < 1e-9))
        sim.move(mesh.nodes_where(lambda x: x[:, 1] > 0.4 - 1e-9), qlb.Translation((0, -1.2, 0)))
        keep = KeepVolume(mesh, stiffness)
        sim.add(keep)
        *_, last = sim.run(steps=10)
        print(f"k = {stiffness:g} Pa: {100 * keep.volume_of(last.positions) / keep.volume:.1f} % of the volume is left")


if __name__ == "__main__":
    main()
