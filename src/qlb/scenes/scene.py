"""The settings that every scene has."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Discriminator, Field, PrivateAttr, Tag, model_validator

from qlb.bodies import Obstacle, Plane
from qlb.contact import Contact
from qlb.energies import Acceleration, Damping
from qlb.errors import InputError
from qlb.integrators import INTEGRATORS
from qlb.materials import AnyMaterial, Fibres, StableNeoHookean
from qlb.scenes.holds import HandleSettings, PinSettings
from qlb.scenes.loads import LoadSettings
from qlb.scenes.obstacles import AnyObstacle
from qlb.scenes.selections import list_of
from qlb.settings import Settings, choice, quantity
from qlb.simulation import OnFailure, Simulation
from qlb.solvers import SOLVERS, SolverSettings, Tolerance
from qlb.system.system import MassKind

if TYPE_CHECKING:
    from qlb.scenes.source import Source

FORMAT_VERSION = 1
"""Of scene files."""

MOST_STEPS = 100_000_000

AnyContact = Annotated[
    Annotated[Contact, Tag("Contact")] | Annotated[Literal[False], Tag("off")],
    Discriminator(lambda value: "off" if value is False else "Contact"),
]
"""Settings of contact, or false for none."""


class OutputSettings(Settings):
    """What a run writes."""

    stride: int = quantity(1, "Write every so many steps a frame and a checkpoint", ge=1)
    precision: Literal["float64", "float32"] = Field(
        "float64", description="of the frames; checkpoints always have float64"
    )
    compress: bool = Field(False, description="Deflate the frames: about two thirds of the size, slower to write")


class Scene(Settings):
    """Settings common to all scenes; a subclass adds its own and builds the simulation."""

    version: Literal[1] = Field(1, description="Of the format of scene files")
    material: AnyMaterial = Field(StableNeoHookean(), description="What the body is made of")
    fibres: Fibres | None = Field(None, description="Fibres that are added to the material")
    mass: MassKind = Field("lumped", description="lumped or consistent mass matrix")
    damping: Damping = Damping()
    loads: LoadSettings = LoadSettings()
    obstacles: Annotated[tuple[AnyObstacle, ...], list_of("{name: ground, normal: [0, 1, 0]}")] = Field(
        (), description="Planes {name, point, normal, motion} and surfaces {name, mesh, placement, motion}"
    )
    pins: Annotated[tuple[PinSettings, ...], list_of("{nodes: x < 0.01}")] = Field(
        (), description="Nodes that are held, such as [{nodes: x < 0.01}]"
    )
    handles: Annotated[
        tuple[HandleSettings, ...], list_of("{nodes: x > 0.99, motion: {kind: translation, velocity: [0.1, 0, 0]}}")
    ] = Field(
        (), description="Nodes that are moved, such as [{nodes: x > 0.9, motion: {kind: rotation, axis: [1, 0, 0]}}]"
    )
    contact: AnyContact | None = Field(
        None, description="How things touch; false: not at all; by default where there are obstacles or several bodies"
    )
    integrator: str = choice("BDF2", "Time integrator", INTEGRATORS)
    solver: str = choice("QLA", "Nonlinear solver", SOLVERS)
    step: float = quantity(1e-2, "Time step h", unit="s", gt=0)
    steps: int = quantity(120, "Number of time steps", ge=1, le=MOST_STEPS)
    tolerance: Tolerance = Tolerance()
    solver_settings: SolverSettings = SolverSettings()
    on_failure: OnFailure = Field(
        "stop",
        description="A step that does not converge: stop; halve it, down to h/256; accept it, marked as not converged",
    )
    threads: int | None = quantity(
        None, "Threads for kernels and BLAS; all that the process may use by default", ge=1, le=1024
    )
    output: OutputSettings = OutputSettings()

    _source: Source | None = PrivateAttr(None)

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

    @classmethod
    def start(cls) -> dict[str, Any]:
        """Plain data of the scene that goes by the name alone: nothing but the defaults."""
        return {}

    @abstractmethod
    def make(self) -> Simulation:
        """The simulation that the scene describes, with all that `add_to` adds.

        Raises:
            InputError: mesh or settings are wrong.
        """

    def build(self) -> Simulation:
        """The simulation that the scene describes.

        Raises:
            InputError: mesh or settings are wrong; with the place in the scene file where that shows.
        """
        with self.located():
            return self.make()

    def come_from(self, source: Source) -> None:
        """Remember where the scene comes from, for errors."""
        self._source = source

    @contextmanager
    def located(self) -> Iterator[None]:
        """Let an `InputError` from within say where in the scene file the wrong key stands."""
        try:
            yield
        except InputError as error:
            raise (error if self._source is None else self._source.located(error)) from None

    def add_to(self, simulation: Simulation) -> None:
        """Add loads, pins and handles. Raises `InputError` for a selection that is empty, or nodes held twice."""
        self.loads.add_to(simulation)
        for k, pin in enumerate(self.pins):
            pin.add_to(simulation, f"pins.{k}")
        for k, handle in enumerate(self.handles):
            handle.add_to(simulation, f"handles.{k}")

    def gravity(self) -> Acceleration:
        """Gravity with its ramp."""
        return self.loads.acceleration(self.steps * self.step if self.integrator == "quasistatic" else 0.0)

    def make_obstacles(self) -> list[Obstacle | Plane]:
        """Those of the settings. Raises `InputError` where one is wrong."""
        return [obstacle.make(f"obstacles.{k}") for k, obstacle in enumerate(self.obstacles)]

    def simulation_arguments(self) -> dict[str, Any]:
        """The keyword arguments of `Simulation` that every scene passes on, for scenes of several bodies."""
        return {
            "obstacles": self.make_obstacles(),
            "contact": self.contact,
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

    def composition(self) -> dict[str, Any]:
        """Material and fibres, as keyword arguments of `Simulation` or `Body`."""
        return {"material": self.material, "fibres": () if self.fibres is None else (self.fibres,)}
