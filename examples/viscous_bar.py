"""Three dampings side by side: a bar is bent, let go, and swings; its decay as a table and as a picture."""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

import qlb

mpl.use("agg")
import matplotlib.pyplot as plt

DAMPINGS = {
    "none": qlb.Damping(),
    "mass, 4 1/s": qlb.Damping(mass=4.0),
    "stiffness, 0.02 s": qlb.Damping(stiffness=0.02),
    "viscosity, 1000 Pa s": qlb.Damping(viscosity=1000.0),
}


def swing(damping: qlb.Damping, steps: int) -> np.ndarray:
    """Height of the tip over where it was at rest [m], after each step of 0.01 s."""
    mesh = qlb.TetMesh.box((1, 0.2, 0.2), cells=(8, 2, 2))
    material = qlb.StableNeoHookean(young=1e5, poisson=0.4)
    sim = qlb.Simulation(mesh, material=material, integrator="SDIRK2", gravity=(0, 0, 0), damping=damping)
    sim.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    bent = mesh.positions.copy()
    bent[:, 1] += 0.2 * mesh.positions[:, 0] ** 2
    sim.restore(qlb.State(0.0, bent, np.zeros_like(bent)), 0, {})
    tip = np.argmax(mesh.positions[:, 0])
    return np.array([result.positions[tip, 1] - mesh.positions[tip, 1] for result in sim.run(steps)])


def main(folder: Path = Path("runs/viscous-bar")) -> None:
    """Print what is left of the swing after one second, and write a plot into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, axes = plt.subplots()
    for name, damping in DAMPINGS.items():
        heights = swing(damping, 120)
        axes.plot(0.01 * np.arange(1, 121), heights, label=name)
        print(f"{name:22} swing in the last 0.4 s: {1000 * np.ptp(heights[-40:]):5.1f} mm")
    axes.set(xlabel="time [s]", ylabel="height of the tip [m]")
    axes.legend()
    figure.savefig(folder / "decay.png")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
