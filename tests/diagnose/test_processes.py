"""Refits on several processes: the same diagnosis, and a process that is lost is no verdict."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from dataclasses import replace

import pytest

from cvxupdate import forked
from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.search import race
from cvxupdate.errors import CvxupdateError
from cvxupdate.forked import every

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="children are for Linux"
)


@pytest.fixture(autouse=True)
def forks(monkeypatch):
    """As if alone on a machine with processors enough; the children that were forked."""
    monkeypatch.setattr(forked, "available", lambda: 8)
    monkeypatch.setattr(threading, "enumerate", lambda: [threading.current_thread()])
    plain, made = os.fork, []

    def fork():
        pid = plain()
        made.append(pid)
        return pid

    monkeypatch.setattr(os, "fork", fork)
    return made


WORDS = ("added_mass", "stiffness_change", "viscous_damper")  # for time


def answer(chain, recordings, jobs, said=None):
    spec, model = chain
    spec = replace(spec, diagnose=spec.diagnose.model_copy(update={"physics": WORDS}))
    tell = None if said is None else said.append
    found = diagnose_problem(spec, model, recordings, tell, jobs=jobs).to_json()
    return {k: v for k, v in found.items() if k != "time"}


@pytest.fixture(scope="module")
def recordings(lab, measure):
    """Of a chain with a lump."""
    real = lab(m=(0, 0.25, 0, 0))
    return measure(real, 4, seed=11), measure(real, 1, "hold-out", seed=12)


def test_the_answer_is_the_same_however_many_processes(chain, recordings, forks):
    heard = [list[str]() for _ in range(3)]
    alone = answer(chain, recordings, 1, heard[0])
    assert not forks
    assert answer(chain, recordings, 2, heard[1]) == alone
    two = len(forks)
    assert two > 2
    assert answer(chain, recordings, 4, heard[2]) == alone
    assert len(forks) > 2 * two
    assert heard[0] == heard[1] == heard[2]


def test_a_lost_process_is_an_error_and_no_verdict(chain, recordings, monkeypatch):
    """What leads to no structure is left out of a search; what was lost is not of that kind."""
    own, plain = os.getpid(), race.refitted

    def lost(evidence, seed, effort):
        if os.getpid() != own:
            os.kill(os.getpid(), signal.SIGKILL)
        return plain(evidence, seed, effort)

    monkeypatch.setattr(race, "refitted", lost)
    with pytest.raises(CvxupdateError, match="ended by signal 9.*--jobs 1"):
        answer(chain, recordings, 2)


def test_what_children_compute_is_taken_from_the_budget():
    def busy(_):
        begin = time.thread_time()
        while time.thread_time() - begin < 0.05:
            pass

    budget, half = Budget(computing=0.6, clock=1e9), Budget(computing=0.6, clock=1e9)
    assert Budget.of(True, 3).jobs == Budget.of(False, 3).part(0.5).jobs == 3
    every(busy, range(3), 3)
    assert not half.over()
    every(busy, range(12), 4)
    assert budget.over() and half.over()
