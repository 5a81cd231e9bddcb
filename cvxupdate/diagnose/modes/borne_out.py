"""Whether modal constants, which no table has and nothing was fitted to, are those of the model
that a search ended with: of what was fitted, and of what was held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.modes.constants import FEWEST, Constants, beside, constants_of
from cvxupdate.diagnose.modes.identified import Identified
from cvxupdate.diagnose.results import Gain
from cvxupdate.diagnose.settings import CHANCE, HALVED
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.residual.modal import ModalPoint


def constants_bear_out(
    last: ModalPoint,
    base: ModalPoint,
    seen: tuple[Sequence[Identified], Sequence[Identified]],
    gains: Sequence[Gain],
) -> bool:
    """Whether those that were fitted, and those that were held out where there are such, are the
    model's within chance (of six modes or more with one left out: leakage makes the constant of a
    narrow one), ``gains`` taken out, and half as far off as the nuisance parameters alone (at
    ``base``) leave them. No, where too few are sure."""
    fitted, held = seen
    if not constants_are_of(last, base, fitted, gains):
        return False
    return not held or constants_are_of(beside(last, held), beside(base, held), held, gains)


def constants_are_met(
    point: ModalPoint, seen: tuple[Sequence[Identified], Sequence[Identified]]
) -> bool:
    """Whether those that were fitted and those that were held out are the model's within chance;
    no, where nothing was held out or too few are sure."""
    fitted, held = seen
    if not held:
        return False
    both = (constants_of(point, fitted), constants_of(beside(point, held), held))
    return all(c is not None and _by_chance(c, ()) for c in both)


def constants_are_of(
    last: ModalPoint, base: ModalPoint, found: Sequence[Identified], gains: Sequence[Gain]
) -> bool:
    """The same of these tables."""
    whole, before = constants_of(last, found), constants_of(base, found)
    if whole is None:
        return False
    if not _by_chance(whole, gains):
        return False
    return before is None or _mean(whole, gains) <= HALVED * _mean(before, ())


def _by_chance(c: Constants, gains: Sequence[Gain]) -> bool:
    """Whether chance leaves so much, of six modes or more with one left out."""
    tried = [c]
    if len(c.modes) >= 2 * FEWEST:
        rest = (c.without(mode) for mode in c.modes)
        tried += [other for other in rest if other is not None]
    return any(left <= most for left, most in (_left(other, gains) for other in tried))


def _mean(c: Constants, gains: Sequence[Gain]) -> float:
    """Squares that are left, of each row."""
    return _left(c, gains)[0] / len(c.y)


def _left(c: Constants, gains: Sequence[Gain]) -> tuple[float, float]:
    """Squares that are left with the gains taken out, and the most that chance leaves."""
    rest = c.y.copy()
    for gain in gains:
        own = ("gain", *gain.channels) if gain.how == "gain" else None
        for k, name in enumerate(c.names):
            of_all = own is None and name[0] == "force" and set(name[1:]) <= set(gain.channels)
            if name == own or (of_all and not _part(name, c, gain)):
                rest -= np.log(gain.value) * c.X[:, k]
    return float(rest @ rest), chi_square_above(1.0 - CHANCE, len(rest))


def _part(name: tuple[str, ...], c: Constants, gain: Gain) -> bool:
    """Whether the drives of a column are some of those of another that the gain has, too."""
    wider = (n for n in c.names if n[0] == "force" and set(n[1:]) <= set(gain.channels))
    return any(set(name[1:]) < set(n[1:]) for n in wider)
