"""Springs between far nodes: a tendon along the lower side of a bar shortens and curls it."""

import numpy as np

import qlb


class Tendons(qlb.StencilEnergy):
    """k/2 (|x_1 - x_0| - l)^2 for pairs of nodes, with l shrinking to a half of what it was within `seconds`."""

    def __init__(self, mesh: qlb.TetMesh, pairs: np.ndarray, stiffness: float, seconds: float) -> None:
        self.stencils, self.stiffness, self.seconds = pairs, stiffness, seconds
        self.rest = np.linalg.norm(mesh.positions[pairs[:, 1]] - mesh.positions[pairs[:, 0]], axis=1)

    def value(self, x: np.ndarray, time: float) -> np.ndarray:
        """[J], one for each spring."""
        return np.asarray(0.5 * self.stiffness * self._stretch(x, time)[0] ** 2)

    def gradient(self, x: np.ndarray, time: float) -> np.ndarray:
        """[N], for both nodes of each spring."""
        stretch, n, _ = self._stretch(x, time)
        pull = self.stiffness * stretch[:, None] * n
        return np.stack([-pull, pull], axis=1)

    def hessian(self, x: np.ndarray, time: float) -> np.ndarray:
        """[N/m], 6 x 6 for each spring."""
        stretch, n, length = self._stretch(x, time)
        along = n[:, :, None] * n[:, None, :]
        B = self.stiffness * (along + (stretch / length)[:, None, None] * (np.eye(3) - along))
        return np.block([[B, -B], [-B, B]])

    def _stretch(self, x: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        d = x[:, 1] - x[:, 0]
        length = np.linalg.norm(d, axis=1)
        return length - self.rest * (1 - 0.5 * min(time / self.seconds, 1.0)), d / length[:, None], length


def main() -> None:
    """Run 30 steps and print how far the tip has come."""
    mesh = qlb.TetMesh.box((1, 0.2, 0.2), cells=(10, 2, 2))
    sim = qlb.Simulation(mesh, material=qlb.StableNeoHookean(young=1e5, poisson=0.4), gravity=(0, 0, 0))
    sim.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    lower = mesh.nodes_where(lambda x: (x[:, 1] < 1e-9) & (np.abs(x[:, 0] * 5 % 1) < 1e-9) & (x[:, 0] > 0.1))
    lower = lower[np.lexsort((mesh.positions[lower, 0], mesh.positions[lower, 2]))].reshape(3, 5)
    pairs = np.stack([lower[:, :-1].ravel(), lower[:, 1:].ravel()], axis=1)
    sim.add(Tendons(mesh, pairs, stiffness=2e4, seconds=0.2))
    results = list(sim.run(steps=30))
    tip = mesh.nodes_where(lambda x: x[:, 0] > 1 - 1e-9)
    right, up, _ = (results[-1].positions - mesh.positions)[tip].mean(axis=0)
    print(f"{len(pairs)} springs, {results[-1].iterations} iterations in the last step")
    print(f"the tip has moved by {right:.2f} m along the bar and {up:.2f} m up")


if __name__ == "__main__":
    main()
