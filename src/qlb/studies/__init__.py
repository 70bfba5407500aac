"""Runs of scenes: one into a directory, several side by side, or all that the supplement's figures need."""

from qlb.studies.compare import Comparison, SolverCase, compare
from qlb.studies.processes import Case, Update
from qlb.studies.reproduce import Plan, Reproduction, plan_figures, reproduce
from qlb.studies.reproduce_figures import FIGURES, SupplementFigure, chosen_figures
from qlb.studies.run import run_scene

__all__ = [
    "FIGURES",
    "Case",
    "Comparison",
    "Plan",
    "Reproduction",
    "SolverCase",
    "SupplementFigure",
    "Update",
    "chosen_figures",
    "compare",
    "plan_figures",
    "reproduce",
    "run_scene",
]
