"""A density of one's own: a bar of Gent's rubber, whose chains cannot be stretched without end, falls from one end."""

import numpy as np
import sympy

import qlb


def main() -> None:
    """Run 20 steps and print how far each half is stretched."""
    # psi = -mu/2 Jm log(1 - (J^-2/3 I1 - 3)/Jm) + kappa/2 (J - 1)^2 (Gent 1996, with a volumetric part): stiffer and
    # stiffer as J^-2/3 I1 - 3 comes near Jm. A parameter can be anything that those of other materials can be.
    I1, _, J = qlb.SymbolicMaterial.invariants  # tr C, |cof F|^2, det F
    mu, kappa, Jm = sympy.symbols("mu kappa Jm", positive=True)
    stretch = I1 * J ** sympy.Rational(-2, 3) - 3
    gent = qlb.SymbolicMaterial(
        psi=-mu / 2 * Jm * sympy.log(1 - stretch / Jm) + kappa / 2 * (J - 1) ** 2,
        parameters={"mu": 1e4, "kappa": 1e5, "Jm": "where(x < 0.5, 0.3, 30)"},  # the held half is nearly used up
        density=1000,
    )

    mesh = qlb.TetMesh.box((1, 0.25, 0.25), cells=(16, 4, 4))
    simulation = qlb.Simulation(mesh, material=gent, step=2e-2)
    simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    for _ in simulation.run(steps=20):
        pass

    # The longest edge of each half, relative to its rest length.
    edges = np.unique(np.sort(mesh.tets[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)), axis=0)
    length = [
        np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1) for x in (simulation.state.positions, mesh.positions)
    ]
    held = mesh.positions[edges].mean(axis=1)[:, 0] < 0.5
    stretches = length[0] / length[1]
    print(
        f"longest stretch after 0.4 s: {stretches[held].max():.3f} (Jm = 0.3), {stretches[~held].max():.3f} (Jm = 30)"
    )


if __name__ == "__main__":
    main()
