from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from qlb.results import RenderingFailed, rendering


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20211110)


@pytest.fixture(autouse=True, scope="session")
def cache_of_meshes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder of this session: tests neither use nor fill that of the user."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("QLB_CACHE", str(folder))
        yield folder


@pytest.fixture
def can_render() -> None:
    pytest.importorskip("pyvista")
    try:
        rendering.window_class()
    except RenderingFailed as error:
        pytest.skip(str(error))
