"""Time integrators. Each supplies the stages of a step, (c, x_b, v_b), and its start-up; nothing else."""

from qlb.integrators.bdf import BDF1, BDF2
from qlb.integrators.integrator import Integrator, Origin, Stage, State
from qlb.integrators.quasistatic import Quasistatic
from qlb.integrators.sdirk2 import SDIRK2
from qlb.registry import found_in

INTEGRATORS: dict[str, type[Integrator]] = found_in(
    __name__,
    Integrator,  # type: ignore[type-abstract]
    lambda kind: kind.name,
    first=("BDF1", "BDF2", "SDIRK2", "quasistatic"),
)
"""Every integrator by the name that scene files and the command line use."""

__all__ = ["BDF1", "BDF2", "INTEGRATORS", "SDIRK2", "Integrator", "Origin", "Quasistatic", "Stage", "State"]
