"""Scenes: what to simulate, as settings that a file or the command line can change."""

from qlb.scenes.arma import ArmaScene
from qlb.scenes.bar import BarScene
from qlb.scenes.bunny import BunnyScene
from qlb.scenes.ducks import DucksScene
from qlb.scenes.files import load_scene, scene_yaml
from qlb.scenes.scene import Scene

SCENES: dict[str, type[Scene]] = {"bar": BarScene, "arma": ArmaScene, "bunny": BunnyScene, "ducks": DucksScene}
"""Every built-in scene by name."""

__all__ = ["SCENES", "ArmaScene", "BarScene", "BunnyScene", "DucksScene", "Scene", "load_scene", "scene_yaml"]
