"""What tables of modes say beside the search: damping ratios, and where FRFs are behind them, gains
of channels and how complex the modes are."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.borne_out import constants_are_met, constants_bear_out
from cvxupdate.diagnose.modes.complexity import complex_modes
from cvxupdate.diagnose.modes.constants import beside, constants_of
from cvxupdate.diagnose.modes.damping import Candidates, damping_laws
from cvxupdate.diagnose.modes.gains import as_it_may_be, gains_of, not_gainsaid
from cvxupdate.diagnose.modes.identified import without_rows
from cvxupdate.diagnose.modes.tables import Tables
from cvxupdate.diagnose.results import Further
from cvxupdate.fe.model import Model


def further_of(
    tables: Tables, last: Fit, base: Fit, original: Model, effects: Candidates
) -> Further:
    """Where the search ended (``last``) and with nuisance parameters alone (``base``);
    ``original``: the file's model; ``effects(zeta)``: those of damping on the fitted one with a
    typical damping ratio."""
    point, known = last.point, len(base.p)
    laws = damping_laws(tables, point, original, effects)
    if not tables.seen:
        return laws
    kept = [without_rows(own, sorted(tables.gone.get(k, ()))) for k, own in enumerate(tables.seen)]
    against = [*tables.left_out, complex_modes([own.table for own in kept])]
    says = " ".join(filter(None, against))
    gains = gains_of(point, kept, as_it_may_be(last, known))
    added = len(last.p) > known
    # what is disputed and has nothing to be borne out asks for no more; nor do too few modes tell
    later = tables.later() if gains or added or not says else ()
    held = later if later and constants_of(beside(point, later), later) is not None else ()
    gains = not_gainsaid(gains, point, held)
    sure = added and constants_bear_out(point, base.point, (kept, held), gains)
    return replace(
        laws,
        gains=gains,
        against=says,
        borne_out=sure,
        foretold=sure and bool(held),
        met=not added and constants_are_met(point, (kept, held)),
    )
