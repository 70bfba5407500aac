"""Handles: one end of a bar is held, the other turns by a script and comes closer; the middle is left to follow."""

import sys
from pathlib import Path

import meshio
import numpy as np

import qlb


def main(folder: Path = Path("runs/twisting-handles")) -> None:
    """Turn by a full revolution within a second; write the end as twisted.vtu into `folder`."""
    mesh = qlb.TetMesh.box((1, 0.2, 0.2), cells=(12, 2, 2))
    sim = qlb.Simulation(mesh, material=qlb.StableNeoHookean(young=5e4, poisson=0.45), step=0.02)
    turn = qlb.Rotation(axis=(1, 0, 0), origin=(1, 0.1, 0.1), rate=1.0, stop=1.0)

    def handle(anchors: np.ndarray, time: float) -> np.ndarray:
        return turn(anchors, time) - [0.1 * min(time, 1.0), 0, 0]

    sim.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    sim.move(mesh.nodes_where(lambda x: x[:, 0] > 1 - 1e-9), handle)
    results = list(sim.run(steps=60))
    end = results[-1]
    middle = mesh.nodes_where(lambda x: np.abs(x[:, 0] - 0.5) < 1e-9)
    drop = 1000 * (end.positions - mesh.positions)[middle, 1].mean()
    iterations = sum(result.iterations for result in results) / len(results)
    print(f"{len(results)} steps, {iterations:.1f} iterations each; the middle hangs {-drop:.0f} mm low")
    folder.mkdir(parents=True, exist_ok=True)
    meshio.write_points_cells(folder / "twisted.vtu", end.positions, [("tetra", mesh.tets)])


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
