"""Worker processes: results come back in order, an error reaches the caller, nothing is left
running."""

from __future__ import annotations

import multiprocessing
import operator
import time

import pytest

from validation.parallel import workers


def test_results_come_back_in_order() -> None:
    with workers(2) as pool:
        assert list(pool.map(operator.neg, range(5))) == [0, -1, -2, -3, -4]
    assert not multiprocessing.active_children()


def test_an_interruption_ends_work_that_is_under_way() -> None:
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), workers(1) as pool:
        pool.submit(time.sleep, 600.0)
        pool.submit(operator.neg, 1)
        while not multiprocessing.active_children():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert time.perf_counter() - begin < 60.0
    assert not multiprocessing.active_children()


def test_an_error_of_a_worker_reaches_the_caller() -> None:
    with pytest.raises(ZeroDivisionError), workers(1) as pool:
        pool.submit(operator.truediv, 1, 0).result()
