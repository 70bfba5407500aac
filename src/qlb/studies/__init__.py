"""Runs of scenes: one, several side by side, those of the supplement's figures, products of settings."""

from qlb.studies.compare import Comparison, SolverCase, compare
from qlb.studies.processes import Case, Update
from qlb.studies.reproduce import Plan, Reproduction, plan_figures, reproduce
from qlb.studies.reproduce_figures import FIGURES, SupplementFigure, chosen_figures
from qlb.studies.run import resume_run, run_scene, scene_of
from qlb.studies.sweep import Sweep, SweepPlan, plan_sweep, sweep

__all__ = [
    "FIGURES",
    "Case",
    "Comparison",
    "Plan",
    "Reproduction",
    "SolverCase",
    "SupplementFigure",
    "Sweep",
    "SweepPlan",
    "Update",
    "chosen_figures",
    "compare",
    "plan_figures",
    "plan_sweep",
    "reproduce",
    "resume_run",
    "run_scene",
    "scene_of",
    "sweep",
]
