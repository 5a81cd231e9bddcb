"""`identify` finds what the public sets' READMEs state; a set that is not there is skipped by
name."""

from __future__ import annotations

import pytest

from validation.real import modes

SLOW = ("test_2.csv", "test_3.csv", "problem_massa4.toml", "problem_schroeder.toml")
FAST = [t for t in modes.TRIALS if t.stated and t.file not in SLOW]


@pytest.mark.parametrize("trial", FAST, ids=lambda t: f"{t.data} {t.file} {t.options.line()}")
def test_what_a_readme_states_is_found(trial: modes.Trial) -> None:
    try:
        assert trial.path.exists()
    except FileNotFoundError as missing:
        pytest.skip(str(missing))
    found = trial.found()
    assert not isinstance(found, str), found
    near = modes.nearest(found, trial.stated)
    for f, stated, within in zip(near, trial.stated, trial.within, strict=True):
        assert abs(f / stated - 1.0) <= within, f"{f} Hz, stated {stated}"


def test_the_page_has_the_commands() -> None:
    """Every trial stands in the table of the page, by its command."""
    text = modes.PAGE.read_text(encoding="utf-8")
    assert [t.command for t in modes.TRIALS if f"`{t.command}`" not in text] == []


def test_the_rests_are_recordings_of_their_own() -> None:
    """No two rests share a sample."""
    import tomllib

    rests = tomllib.loads(modes.RESTS.read_text(encoding="utf-8"))["recordings"]
    ends = [x for r in rests for x in (r["start"], r["stop"])]
    assert len(rests) == 10 and ends == sorted(ends)
