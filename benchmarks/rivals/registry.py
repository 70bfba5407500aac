"""Which packages there are to run, and what each can solve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

ACCURATE = 1e-5
"""Largest distance of a node from the reference, over the longest side, that counts as the same answer."""


@dataclass(frozen=True)
class Rival:
    """A package in one configuration."""

    name: str
    module: str
    """the adapter, in this folder"""
    log: bool
    """its Stable Neo-Hookean density, see `Problem`"""
    imports: tuple[str, ...] = ()
    """modules that its Python must have"""
    integrators: tuple[str, ...] = ("BDF1", "BDF2")
    options: Mapping[str, str] = field(default_factory=dict)
    raised: str = ""
    """the option that is raised until the result is accurate, for what has no tolerance"""

    @property
    def is_qlb(self) -> bool:
        """Whether it runs under our own Python."""
        return self.module == "qlb_itself"


BEST_ND = {"solver": "ND", "projection": "on-demand", "initial_guess": "predictor"}
REFERENCE = Rival("reference", "qlb_itself", True, options=BEST_ND)

RIVALS = (
    *(Rival("qlb QLA", "qlb_itself", log, options={"solver": "QLA"}) for log in (True, False)),
    *(Rival("qlb ND", "qlb_itself", log, options=BEST_ND) for log in (True, False)),
    Rival("simkit", "simkit_newton", True, ("simkit",)),
    Rival("scikit-fem", "scikit_fem_newton", True, ("skfem",)),
    Rival("ngsolve", "ngsolve_newton", True, ("ngsolve",)),
    Rival("pbatoolkit", "pbatoolkit_newton", False, ("pbatoolkit",)),
    Rival("pbatoolkit VBD", "pbatoolkit_vbd", False, ("pbatoolkit",), ("BDF1",), {"sweeps": "10"}, "sweeps"),
    Rival("newton VBD", "newton_vbd", False, ("newton",), ("BDF1",), {"iterations": "20"}, "iterations"),
)

DISTRIBUTIONS = {
    "simkit": "simkit",
    "skfem": "scikit-fem",
    "ngsolve": "ngsolve",
    "pbatoolkit": "pbatoolkit",
    "newton": "newton",
    "warp": "warp-lang",
    "pypardiso": "pypardiso",
    "sksparse": "scikit-sparse",
    "numpy": "numpy",
    "scipy": "scipy",
}
"""Distributions on PyPI whose versions a table must name, by module."""
