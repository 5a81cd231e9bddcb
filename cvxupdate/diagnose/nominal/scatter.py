"""Nuisance parameters: what drawing and laboratory always differ by."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.diagnose.nominal.theory import ASIDE, GROUP, SIZES, theory_parameters
from cvxupdate.diagnose.settings import (
    ALIKE_STD,
    CREDIBLE,
    FREE,
    MASS_STD,
    STIFFNESS_STD,
    WIDE,
)
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import has_property, select_parameters
from cvxupdate.physics.alike import OWN
from cvxupdate.physics.given import is_given
from cvxupdate.physics.growth import Wanted

MEMBER = "exact member "
"""How the groups begin that divided members get (`cvxupdate.diagnose.nominal.members`): each the
parts of one member, drawn as the others are."""


def with_nuisance(
    model: Model,
    scatter: float = 1.0,
    theory: tuple[str, ...] = (),
    own: frozenset[int] | None = None,
) -> Model:
    """The model with a stiffness and a mass p-value for every group, and one for all elements of a
    kind that have none, within credible bounds. ``scatter``: part of the usual scatter, of a model
    that was calibrated on this very structure; ``theory``: words of
    `cvxupdate.diagnose.nominal.theory`; ``own``: elements of the file alone, where a reference was
    found to have others beside them, which stay as they were found."""
    wanted: list[Wanted] = []
    for of, std in (("stiffness", STIFFNESS_STD), ("mass", MASS_STD)):
        limit = CREDIBLE * std * scatter
        groups: dict[str, list[int]] = {}
        for block in model.blocks:
            if has_property(block, of) and not is_given(block):
                for element, group in zip(block.ids.tolist(), block.groups, strict=True):
                    if own is not None and element not in own:
                        continue
                    drawn = "" if group.startswith(MEMBER) else group
                    groups.setdefault(drawn or block.kind.name, []).append(element)
        wanted += [
            Wanted(f"{g}.{of}", of, tuple(dict.fromkeys(ids)), g, -limit, limit)
            for g, ids in groups.items()
        ]
    wanted += theory_parameters(model, theory)
    return model.with_parameters(select_parameters(wanted, model))


def let_far(model: Model, own: frozenset[int]) -> Model:
    """A model whose groups of elements ``own`` may be far beyond their scatter: what a reference
    was found to have beside them stays as it is."""
    return model.with_parameters(
        [
            replace(q, lower=-WIDE, upper=WIDE)
            if q.group not in (GROUP, ASIDE) and own.issuperset(q.elements)
            else q
            for q in model.parameters
        ]
    )


def scatter_of(q: Parameter) -> float:
    """Prior deviation of a group's p-value: `CREDIBLE` of them reach its bound, and it is at most
    the usual one; of a part of the theory its own, and of one of a class."""
    if q.group == GROUP:
        return SIZES[q.of][1]
    if q.group == OWN:
        return ALIKE_STD
    if q.group == ASIDE:
        return q.upper / CREDIBLE
    return min(MASS_STD if q.of == "mass" else STIFFNESS_STD, q.upper / CREDIBLE)


def prior_scales(model: Model, wide: bool = False) -> list[float]:
    """Prior standard deviations of a model's parameters: groups scatter as usual (``wide``: their
    stiffness may go as far as a parameter error is followed), effects are free."""

    def scale(q: Parameter) -> float:
        if q.group is None:
            return FREE
        return WIDE if wide and q.of == "stiffness" and q.upper >= WIDE else scatter_of(q)

    return [scale(q) for q in model.parameters]
