"""What a user can set about contact."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from qlb.errors import InputError
from qlb.settings import Settings, quantity


class ContactPair(Settings):
    """What holds between two bodies, obstacles or planes (or one body and itself), in place of the general values."""

    between: tuple[str, str] = Field(description="Two names; the same one twice for a body and itself")
    collide: bool = Field(True, description="Whether they can touch at all")
    friction: float | None = quantity(None, "Coulomb's coefficient mu between them; the general one by default", ge=0)


def _pairs(value: Any) -> Any:
    if not isinstance(value, list | tuple):
        raise InputError(f"{value!r} must be a list of pairs, such as [{{between: [duck, ground], friction: 0.3}}]")
    return value


class Contact(Settings):
    """Contact of bodies with themselves, with each other and with obstacles.

    Between two surfaces d apart acts, per area, the energy kappa dhat b(d/dhat) with b(s) = -(s - 1)^2 ln s for s < 1
    and 0 from there on (Li et al. 2020): none at dhat, growing without bound towards 0.
    """

    mode: Literal["barrier", "penalty"] = Field(
        "barrier",
        description="barrier: nothing ever passes through anything; penalty: springs that push apart what is closer"
        " than dhat or has passed through, as in the paper",
    )
    dhat: float | None = quantity(
        None,
        "Distance at which contact begins to act; by default a tenth of the mean edge of the bodies' surfaces. Smaller"
        " is closer to hard contact, and takes more iterations. Parts of one body that are nearer to each other at rest"
        " act from half their distance at rest on",
        unit="m",
        gt=0,
    )
    stiffness: float | None = quantity(
        None,
        "kappa, about the pressure at which surfaces are dhat/2 apart; by default the largest Young's modulus of the"
        " bodies. Softer keeps surfaces further from 0 and nearer to dhat, at the same forces",
        unit="Pa",
        gt=0,
    )
    friction: float = quantity(0.0, "Coulomb's coefficient mu wherever two things touch", ge=0)
    friction_velocity: float | None = quantity(
        None,
        "Sliding slower than this is resisted by less than mu times the normal force, so that friction is smooth (Li et"
        " al. 2020); what should stick creeps by up to this. By default 1/1000 of the bodies' extent a second",
        unit="m/s",
        gt=0,
    )
    friction_passes: int = quantity(
        2,
        "How often normal forces and directions of sliding are taken anew in a solve, each time with a solve from"
        " where the last ended; one leaves 1 to 3 % of the friction out, two about 0.1 %",
        ge=1,
        le=100,
    )
    self_contact: bool = Field(True, description="Whether a body can touch itself")
    pairs: Annotated[tuple[ContactPair, ...], BeforeValidator(_pairs)] = Field(
        (), description="Exceptions for some, such as [{between: [duck, ground], friction: 0.3}]"
    )
    check: bool = Field(
        False, description="After each step, search all surfaces for intersections, and stop where there is one"
    )
