"""Runs of scenes: one into a directory, or several side by side."""

from qlb.studies.compare import Comparison, SolverCase, compare
from qlb.studies.run import run_scene

__all__ = ["Comparison", "SolverCase", "compare", "run_scene"]
