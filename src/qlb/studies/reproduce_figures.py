"""The figures of the supplement: what each varies, row by row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from qlb.errors import InputError
from qlb.studies.statements import Statement, alike, converge, fails, grows, grows_more, more, times_above, two_stages


@dataclass(frozen=True)
class Counts:
    """Nonlinear iterations a step."""

    mean: float
    max: int
    failed: int | None = None
    """steps that did not converge, where that is known"""

    def __str__(self) -> str:
        """As in "373 / 500, 80 failed"."""
        return f"{self.mean:g} / {self.max}" + (f", {self.failed} failed" if self.failed else "")


@dataclass(frozen=True)
class Row:
    """One row of a figure."""

    label: str
    name: str
    """for folders, such as young-6e3"""
    overrides: tuple[str, ...]
    """KEY=VALUE of the scene"""
    prototype: Mapping[str, Counts] = field(default_factory=dict)
    """by solver: what an independent prototype needed for this very row (3000 tets, 120 steps)"""


@dataclass(frozen=True)
class SupplementFigure:
    """A figure of the supplement: rows are a variation, columns are the solvers."""

    number: int
    title: str
    parameter: str
    """what the supplement varies, with its unit"""
    scene: str
    rows: tuple[Row, ...]
    expectation: str
    """what to look for: our reading, in our words"""
    statements: tuple[Statement, ...]
    """what the runs are held against"""
    settings: tuple[str, ...] = ()
    """KEY=VALUE for all rows; what the user sets wins"""


COLUMNS = ("ND", "QLF", "QLB", "QLA")
"""The columns of every figure: the solvers of the paper, then ours."""


def _counts(nd: Counts, qlf: Counts, qlb: Counts) -> dict[str, Counts]:
    return {"ND": nd, "QLF": qlf, "QLB": qlb}


_OTHERS = ("ND", "QLB", "QLA")
_CONVERGE = Statement("ND, QLB and QLA converge in every step.", converge(*_OTHERS))
_DEFAULT = _counts(Counts(6.6, 14), Counts(235, 461), Counts(7.4, 12))

_STIFFNESS = SupplementFigure(
    1,
    "Stiffness",
    "Young's modulus E [Pa]",
    "bar",
    (
        Row(
            "E = 6e3 Pa",
            "young-6e3",
            ("material.young=6e3",),
            _counts(Counts(5.9, 15), Counts(185, 500), Counts(7.0, 19)),
        ),
        Row("E = 2e4 Pa", "young-2e4", ("material.young=2e4",), _DEFAULT),
        Row("E = 5e4 Pa", "young-5e4", ("material.young=5e4",)),
        Row(
            "E = 1e5 Pa",
            "young-1e5",
            ("material.young=1e5",),
            _counts(Counts(8.3, 21), Counts(373, 500, 80), Counts(9.8, 23)),
        ),
    ),
    "The stiffer the bar, the more iterations QLF needs, up to steps that do not converge: its one factor, of the rest"
    " shape, says less and less about a bar that has turned. ND and QLB grow by little.",
    (
        Statement("QLF needs the more iterations the stiffer the bar is.", grows("QLF")),
        Statement("The stiffest bar has steps in which QLF does not converge.", fails("QLF", "E = 1e5 Pa")),
        Statement("QLF grows more with the stiffness than the others.", grows_more("QLF", _OTHERS)),
        _CONVERGE,
    ),
)
_INCOMPRESSIBILITY = SupplementFigure(
    2,
    "Incompressibility",
    "Poisson's ratio nu",
    "bar",
    (
        Row(
            "nu = 0.42",
            "poisson-0.42",
            ("material.poisson=0.42",),
            _counts(Counts(5.5, 12), Counts(34.7, 58), Counts(5.0, 7)),
        ),
        Row("nu = 0.49", "poisson-0.49", ("material.poisson=0.49",), _DEFAULT),
    ),
    "Close to incompressible, QLF needs several times what it needs at nu = 0.42; ND and QLB a few more.",
    (
        Statement("Near incompressibility all solvers of the paper need more.", grows("ND", "QLF", "QLB")),
        Statement("QLF grows more with Poisson's ratio than the others.", grows_more("QLF", _OTHERS)),
        _CONVERGE,
    ),
)
_HETEROGENEITY = SupplementFigure(
    3,
    "Heterogeneity",
    "stiffness that differs from place to place: on, off",
    "bar",
    (
        Row(
            "heterogeneous",
            "heterogeneous",
            ("heterogeneous=true",),
            _counts(Counts(12.4, 36), Counts(368, 500, 80), Counts(11.0, 17)),
        ),
        Row("homogeneous", "homogeneous", ("heterogeneous=false",), _DEFAULT),
    ),
    "With stiff and soft slabs in turn, all solvers need more; QLF fails in many steps, QLB stays near ND.",
    (
        Statement(
            "Stiff and soft slabs in turn take more iterations of the paper's solvers.",
            more("heterogeneous", "homogeneous", ("ND", "QLF", "QLB")),
        ),
        Statement("On the heterogeneous bar QLF has steps that do not converge.", fails("QLF", "heterogeneous")),
        _CONVERGE,
    ),
)
_ANISOTROPY = SupplementFigure(
    4,
    "Anisotropy",
    "fibres in the material: on, off",
    "bar",
    (
        Row(
            "anisotropic",
            "anisotropic",
            ("anisotropic=true",),
            _counts(Counts(7.2, 14), Counts(184, 347), Counts(7.2, 11)),
        ),
        Row("isotropic", "isotropic", ("anisotropic=false",), _DEFAULT),
    ),
    "Fibres make little difference to ND and QLB; QLF stays more than ten times above them either way.",
    (
        Statement("Fibres make little difference to ND and QLB: less than 1.5 times.", alike(("ND", "QLB"), 1.5)),
        Statement(
            "QLF needs more than ten times as many as QLB, with fibres and without.", times_above("QLF", "QLB", 10)
        ),
        _CONVERGE,
    ),
)
_INTEGRATORS = SupplementFigure(
    5,
    "Integrators",
    "time integrator",
    "bar",
    (
        Row("BDF2", "BDF2", ("integrator=BDF2",), _DEFAULT),
        Row("BDF1", "BDF1", ("integrator=BDF1",), _counts(Counts(8.8, 24), Counts(336, 500, 58), Counts(8.2, 13))),
        Row("quasistatic", "quasistatic", ("integrator=quasistatic",)),
    ),
    "BDF1 needs more than BDF2, whose stage is two thirds as long, so that inertia helps it more. Quasistatics has no"
    " inertia at all, and gravity grows over the whole run.",
    (
        Statement("BDF1 needs more than BDF2.", more("BDF1", "BDF2", ("ND", "QLF", "QLB"))),
        Statement(
            "QLF has steps that do not converge with BDF1 and in quasistatics.", fails("QLF", "BDF1", "quasistatic")
        ),
        _CONVERGE,
    ),
)

_DAMPING = SupplementFigure(
    6,
    "Damping",
    "mass-proportional damping [1/s]",
    "arma",
    (
        Row("damping 0", "damping-0", ("damping.mass=0",)),
        Row("damping 100 / s", "damping-100", ("damping.mass=100",)),
    ),
    "The armadillo is pulled by its hands and let go at 0.4 s. Damped by 100 / s it creeps back where it would swing:"
    " damping adds to the mass, and to what inertia says about the next step, so that all solvers need less.",
    (
        Statement("Without damping all solvers need more.", more("damping 0", "damping 100 / s", COLUMNS)),
        Statement("QLF needs at least twice as many as QLB, damped or not.", times_above("QLF", "QLB", 2)),
        _CONVERGE,
    ),
)
_MATERIALS = SupplementFigure(
    7,
    "Materials",
    "hyperelastic material",
    "arma",
    (
        Row("SNH", "SNH", ("material.model=SNH",)),
        Row("StVK", "StVK", ("material.model=StVK",)),
    ),
    "St. Venant-Kirchhoff stiffens as it is stretched and gives way as it is compressed: the arms hold more energy when"
    " they are let go, and need more iterations as they swing, of every solver.",
    (
        Statement("StVK takes more iterations of all solvers than Stable Neo-Hookean.", grows(*COLUMNS)),
        Statement("QLF has steps of StVK that do not converge.", fails("QLF", "StVK")),
        _CONVERGE,
    ),
)
_STEPS = SupplementFigure(
    8,
    "Time step",
    "time step h [s]",
    "arma",
    (
        Row("h = 5e-3 s", "step-5e-3", ("step=5e-3",)),
        Row("h = 1e-2 s", "step-1e-2", ("step=1e-2",)),
        Row("h = 2e-2 s", "step-2e-2", ("step=2e-2",)),
    ),
    "The longer the step, the less inertia has to say, and the further the shape moves from that of the factor: all"
    " solvers need more, QLF by far the most. All rows take as many steps, so that they end at different times; the"
    " hands are let go at 0.4 s in each.",
    (
        Statement(
            "All solvers of the paper need the more iterations the longer the step is.", grows("ND", "QLF", "QLB")
        ),
        Statement("At the longest step QLF has steps that do not converge.", fails("QLF", "h = 2e-2 s")),
        _CONVERGE,
    ),
)

_SPRINGS = ("contact.mode=penalty", "contact.stiffness=2e5", "contact.friction_passes=1")
"""Ten times Young's modulus, with friction taken from the start of a stage alone."""
_BUNNY = SupplementFigure(
    9,
    "Bunny",
    "one body with self-contact on the ground",
    "bunny",
    (Row("barrier", "barrier", ()), Row("springs of 10 E", "springs", _SPRINGS)),
    "SDIRK2 solves twice a step: its first stage is blue, its second red. While the bunny falls freely nothing needs"
    " more than a few iterations. When it lands, the barrier adds forces that no factor from before the contact knows"
    " of: QLF runs into the limit of 500 iterations and does not converge, step after step; plain QLB has trouble where"
    " contacts appear within a step; ND stays in the tens, each with a factor of its own. With springs in place of the"
    " barrier, ten times as stiff as the body, bodies pass a little through each other, and QLB converges throughout.",
    (
        Statement("QLF does not converge.", fails("QLF")),
        Statement("With springs of 10 E, QLB converges in every step.", converge("QLB", row="springs of 10 E")),
        Statement("SDIRK2 solves twice a step, drawn in blue and red.", two_stages(*COLUMNS)),
        Statement("ND and QLA converge in every step.", converge("ND", "QLA")),
    ),
    ("mesh.tets=2500", "drop.height=0.1", "steps=80"),
)
_DUCKS = SupplementFigure(
    10,
    "Ducks",
    "several bodies on each other and the ground",
    "ducks",
    (Row("ducks", "ducks", ()),),
    "As figure 9, with contacts between bodies that come and go all the time, so that most steps are hard: QLF and"
    " plain QLB need hundreds of iterations, and do not always get there.",
    (
        Statement("SDIRK2 solves twice a step, drawn in blue and red.", two_stages(*COLUMNS)),
        Statement("QLF has steps that do not converge.", fails("QLF")),
        Statement("ND and QLA converge in every step.", converge("ND", "QLA")),
    ),
    ("mesh.tets=700", "stack.height=0.02", "stack.spacing=0.01", "steps=60"),
)

_OF_BAR = (_STIFFNESS, _INCOMPRESSIBILITY, _HETEROGENEITY, _ANISOTROPY, _INTEGRATORS)
_ALL = (*_OF_BAR, _DAMPING, _MATERIALS, _STEPS, _BUNNY, _DUCKS)

FIGURES: dict[int, SupplementFigure] = {figure.number: figure for figure in _ALL}
"""Every figure, by its number in the supplement."""


def chosen_figures(names: Iterable[str] = ()) -> list[SupplementFigure]:
    """The figures of the numbers in `names`, in order and each once; all where there is none.

    Raises:
        InputError: a figure that is not in the supplement.
    """
    numbers = {_number(name) for name in names}
    return [figure for figure in FIGURES.values() if not numbers or figure.number in numbers]


def _number(name: str) -> int:
    known = ", ".join(map(str, FIGURES))
    number = int(name) if name.isascii() and name.isdigit() else 0
    if number in FIGURES:
        return number
    raise InputError(f"figure {name!r} is not known; there are {known}")
