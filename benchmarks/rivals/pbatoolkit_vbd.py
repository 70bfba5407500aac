"""PBA toolkit's own Vertex Block Descent (Chen, Liu, Yang, Yuksel 2024) on the CPU: implicit Euler by block sweeps.

It stops after a number of sweeps, not at a tolerance: `sweeps` a step is the option, and the error says what it bought.
"""

from __future__ import annotations

import numpy as np
import pbatoolkit

from benchmarks.rivals.problem import FloatArray, Problem

vbd = pbatoolkit.pbat.sim.vbd


class VbdSimulation:
    """Its integrator from the best start and with the best acceleration that it offers, as tried on 1536 tets.

    Anderson's acceleration saves more than half of the sweeps, Broyden's nearly as much; Chebyshev's made it worse.
    """

    def __init__(self, problem: Problem, sweeps: int, window: int) -> None:
        count = len(problem.tets)
        self.problem, self.sweeps = problem, sweeps
        data = vbd.Data().with_volume_mesh(np.asfortranarray(problem.positions.T), np.asfortranarray(problem.tets.T))
        data = data.with_acceleration(np.asfortranarray(np.tile(problem.gravity[:, None], len(problem.positions))))
        constants = (problem.density, problem.mu, problem.lam)
        data = data.with_material(*(np.full(count, value) for value in constants))
        data = data.with_dirichlet_vertices(np.flatnonzero(problem.fixed))
        data = data.with_initialization_strategy(vbd.InitializationStrategy.KineticEnergyMinimum)
        if window > 0:
            data = data.with_anderson_acceleration(window)
        self.integrator = vbd.Integrator(data.construct())
        self.settings = f"its solver, {sweeps} sweeps a step, Anderson {window}"

    def step(self) -> int:
        """Advance by h; the sweeps that it took."""
        self.integrator.step(self.problem.step, self.sweeps, 1)
        return self.sweeps

    def positions(self) -> FloatArray:
        """Now [m], shape (n, 3)."""
        return np.array(self.integrator.x.T)


def build(problem: Problem, options: dict[str, str]) -> VbdSimulation:
    """Set it up."""
    assert not problem.log, "its density is that without the logarithm"
    assert problem.integrator == "BDF1", "it integrates by implicit Euler"
    return VbdSimulation(problem, int(options.get("sweeps", "100")), int(options.get("window", "10")))
