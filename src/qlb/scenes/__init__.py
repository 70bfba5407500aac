"""Scenes: what to simulate, as settings that a file or the command line can change."""

from qlb.registry import found_in
from qlb.scenes.bar import BarScene
from qlb.scenes.bunny import BunnyScene
from qlb.scenes.ducks import DucksScene
from qlb.scenes.files import load_scene, scene_yaml
from qlb.scenes.scene import Scene

SCENES: dict[str, type[Scene]] = found_in(
    __name__,
    Scene,  # type: ignore[type-abstract]
    lambda kind: str(kind.model_fields["scene"].default),
    first=("bar",),
)
"""Every built-in scene by name."""

__all__ = ["SCENES", "BarScene", "BunnyScene", "DucksScene", "Scene", "load_scene", "scene_yaml"]
