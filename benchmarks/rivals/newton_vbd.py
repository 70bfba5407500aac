"""Newton's (NVIDIA and others, Apache-2.0) Vertex Block Descent, on Warp's CPU backend: implicit Euler in float32.

It stops after a number of iterations, not at a tolerance: `iterations` a step is the option, and the error says what
it bought.
"""

from __future__ import annotations

import newton
import numpy as np
import warp

from benchmarks.rivals.problem import FloatArray, Problem


class NewtonVbdSimulation:
    """Its `SolverVBD` without contacts or damping, held nodes as particles without mass."""

    def __init__(self, problem: Problem, iterations: int) -> None:
        warp.config.quiet = True
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=tuple(map(float, problem.gravity)))
        builder.add_soft_mesh(
            pos=warp.vec3(0.0, 0.0, 0.0),
            rot=warp.quat_identity(),
            scale=1.0,
            vel=warp.vec3(0.0, 0.0, 0.0),
            vertices=[warp.vec3(*x) for x in problem.positions],
            indices=problem.tets.ravel().tolist(),
            density=problem.density,
            k_mu=problem.mu,
            k_lambda=problem.lam - problem.mu,  # to which it adds mu
            k_damp=0.0,
            add_surface_mesh_edges=False,
        )
        for node in np.flatnonzero(problem.fixed):
            builder.particle_mass[node] = 0.0
        builder.color()
        model = builder.finalize(device="cpu")
        self._now, self._next, self._control = model.state(), model.state(), model.control()
        self._solver = newton.solvers.SolverVBD(model, iterations=iterations)
        self._step, self._iterations = problem.step, iterations
        self.settings = f"its solver in float32, {iterations} iterations a step"

    def step(self) -> int:
        """Advance by h; the iterations that it took."""
        self._now.clear_forces()
        self._solver.step(self._now, self._next, self._control, None, self._step)
        self._now, self._next = self._next, self._now
        return self._iterations

    def positions(self) -> FloatArray:
        """Now [m], shape (n, 3)."""
        return np.asarray(self._now.particle_q.numpy(), dtype=np.float64)


def build(problem: Problem, options: dict[str, str]) -> NewtonVbdSimulation:
    """Set it up."""
    assert not problem.log, "its density is that without the logarithm"
    assert problem.integrator == "BDF1", "it integrates by implicit Euler"
    return NewtonVbdSimulation(problem, int(options.get("iterations", "100")))
