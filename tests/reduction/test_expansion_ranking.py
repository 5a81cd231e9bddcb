"""The ranking of expansion methods that 2.10 quotes: what of it our experiment confirms, and what
it refutes."""

import pytest

from validation.studies import expansion_ranking as study
from validation.studies.wish import Wish


@pytest.fixture(scope="module")
def results():
    return study.experiment(draws=10)


def best(ranks):
    return min(ranks, key=ranks.get)


def test_confirmed_guyan_is_last_and_serepa_beats_serep_with_good_places_and_clean_shapes(
    results,
):
    for structure in ("two bays", "bent mast"):
        row = results[structure, "good", 0.0]
        assert row["SEREPa"] < row["SEREP"]
        assert row["IRS"] < row["Guyan"] and row["dynamic"] < row["Guyan"]
    ranks = study.mean_ranks(results, chosen=lambda k: k[1] == "good" and k[2] < 0.1)
    assert max(ranks, key=ranks.get) == "Guyan"


def test_confirmed_serep_is_best_with_noise_and_distributed_places(results):
    ranks = study.mean_ranks(results, chosen=lambda k: k[1] != "poor" and k[2] == 0.1)
    assert best(ranks) == "SEREP"


def test_confirmed_serepa_is_sensitive_to_the_places(results):
    for structure in ("two bays", "bent mast"):
        assert (
            results[structure, "spread", 0.1]["SEREPa"]
            > 2 * results[structure, "spread", 0.1]["SEREP"]
        )
        assert results[structure, "poor", 0.02]["SEREPa"] == 1.0  # cannot even be formed


def test_refuted_as_a_general_order(results):
    """Over all cases dynamic expansion at each measured frequency is first, SEREPa last; SEREP
    fails with poor places."""
    ranks = study.mean_ranks(results)
    assert best(ranks) == "dynamic" and max(ranks, key=ranks.get) == "SEREPa"
    poor = study.mean_ranks(results, chosen=lambda k: k[1] == "poor")
    assert best(poor) == "dynamic" and poor["SEREP"] > poor["Guyan"]


def test_the_hybrid_lies_between_tam_and_guyan_or_beats_both(results):
    for key, row in results.items():
        if key[1] != "poor":
            assert row["hybrid TAM"] < 1.02 * max(row["TAM"], row["Guyan"])


def test_the_study_writes_its_table_and_figure(results, tmp_path, monkeypatch):
    monkeypatch.setattr(study, "experiment", lambda draws: results)
    assert study.main(tmp_path, Wish(quick=True)) is results
    assert (
        "quoted         SEREP, SEREPa, TAM, dynamic, IRS, Guyan"
        in (tmp_path / "table.txt").read_text()
    )
    assert (tmp_path / "expansion_ranking.png").stat().st_size > 20_000
