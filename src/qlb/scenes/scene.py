"""The settings that every scene has."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, model_validator

from qlb.energies import Acceleration, Damping
from qlb.integrators import INTEGRATORS
from qlb.materials import AnyMaterial, Fibres, StableNeoHookean
from qlb.scenes.loads import LoadSettings
from qlb.settings import Settings, choice, quantity
from qlb.simulation import OnFailure, Simulation
from qlb.solvers import SOLVERS, SolverSettings, Tolerance
from qlb.system.system import MassKind


class OutputSettings(Settings):
    """What a run writes."""

    stride: int = quantity(1, "Write every so many steps a frame and a checkpoint", ge=1)
    precision: Literal["float64", "float32"] = Field(
        "float64", description="of the frames; checkpoints always have float64"
    )
    compress: bool = Field(False, description="Deflate the frames: about two thirds of the size, slower to write")


class Scene(Settings):
    """Settings common to all scenes; a subclass adds its own and builds the simulation."""

    material: AnyMaterial = Field(StableNeoHookean(), description="What the body is made of")
    fibres: Fibres | None = Field(None, description="Fibres that are added to the material")
    mass: MassKind = Field("lumped", description="lumped or consistent mass matrix")
    damping: Damping = Damping()
    loads: LoadSettings = LoadSettings()
    integrator: str = choice("BDF2", "Time integrator", INTEGRATORS)
    solver: str = choice("QLA", "Nonlinear solver", SOLVERS)
    step: float = quantity(1e-2, "Time step h", unit="s", gt=0)
    steps: int = quantity(120, "Number of time steps", ge=1)
    tolerance: Tolerance = Tolerance()
    solver_settings: SolverSettings = SolverSettings()
    on_failure: OnFailure = Field(
        "stop",
        description="A step that does not converge: stop; halve it, down to h/256; accept it, marked as not converged",
    )
    threads: int | None = quantity(None, "Threads for kernels and BLAS; all that the process may use by default", ge=1)
    output: OutputSettings = OutputSettings()

    @model_validator(mode="before")
    @classmethod
    def _keep_own_defaults(cls, data: Any) -> Any:
        """Where part of a group is given, such as contact.dhat, the rest is as the scene has it by default."""
        if not isinstance(data, Mapping):
            return data
        given = dict(data)
        for name, field in cls.model_fields.items():
            default, group = field.default, given.get(name)
            if not (isinstance(default, Settings) and isinstance(group, Mapping)):
                continue
            own = {key: getattr(default, key) for key in default.model_fields_set}
            if group.get("model", getattr(default, "model", None)) == getattr(default, "model", None):
                given[name] = own | dict(group)
        return given

    @abstractmethod
    def build(self) -> Simulation:
        """The simulation that the scene describes, with its loads (`self.loads.add_to`).

        Raises:
            InputError: mesh or settings are wrong.
        """

    def gravity(self) -> Acceleration:
        """Gravity with its ramp."""
        return self.loads.acceleration(self.steps * self.step if self.integrator == "quasistatic" else 0.0)

    def simulation_arguments(self) -> dict[str, Any]:
        """The keyword arguments of `Simulation` that every scene passes on."""
        return {
            "material": self.material,
            "fibres": () if self.fibres is None else (self.fibres,),
            "integrator": self.integrator,
            "solver": self.solver,
            "step": self.step,
            "gravity": self.gravity(),
            "mass": self.mass,
            "damping": self.damping,
            "tolerance": self.tolerance,
            "solver_settings": self.solver_settings,
            "on_failure": self.on_failure,
            "threads": self.threads,
        }
