"""Scenes: what to simulate, as settings that a file or the command line can change."""

from qlb.registry import found_in
from qlb.scenes.arma import ArmaScene
from qlb.scenes.bar import BarScene
from qlb.scenes.bodies import BodiesScene
from qlb.scenes.bunny import BunnyScene
from qlb.scenes.ducks import DucksScene
from qlb.scenes.files import load_scene
from qlb.scenes.scene import Scene
from qlb.scenes.schema import scene_schema
from qlb.scenes.writing import scene_yaml

SCENES: dict[str, type[Scene]] = found_in(
    __name__,
    Scene,  # type: ignore[type-abstract]
    lambda kind: str(kind.model_fields["scene"].default),
    first=("bar", "arma", "bunny", "ducks"),
)
"""Every built-in scene by name."""

__all__ = [
    "SCENES",
    "ArmaScene",
    "BarScene",
    "BodiesScene",
    "BunnyScene",
    "DucksScene",
    "Scene",
    "load_scene",
    "scene_schema",
    "scene_yaml",
]
