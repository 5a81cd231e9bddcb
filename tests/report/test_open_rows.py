"""What the recordings leave open, and what chose it."""

from types import SimpleNamespace
from typing import Any

from cvxupdate.report.open_rows import open_sentence


def said(*prior: float | None, kinds: tuple[str, ...] = (), free: int = 5) -> str:
    made: Any = SimpleNamespace(
        undetermined=[{"prior": v} for v in prior],
        told={"equations": 320, "free": free, "determined": free - len(prior)},
        parameters=range(6),
        regularisation=[{"kind": k} for k in kinds],
    )
    return open_sentence(made)


def test_a_prior_that_chose_is_named_with_its_part() -> None:
    text = said(0.93, 1.0, kinds=("prior",))
    assert text.startswith(
        "The recordings give 320 real equations for 5 free combinations of 6 parameters and "
        "determine 3 of them. Along the other 2 the prior chose"
    )
    assert "93 to 100 % of what is known there comes from the prior" in text
    assert "Along the other one the prior chose" in said(0.93, kinds=("prior",))


def test_without_a_prior_it_is_said_what_chose() -> None:
    assert "the regularisation (tikhonov) chose" in said(None, kinds=("tikhonov",))
    assert "no prior chose: their values rest on the bounds" in said(None, None)


def test_nothing_open_is_said_in_numbers() -> None:
    assert said().endswith("and determine 5 of them.")
