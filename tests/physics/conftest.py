"""Structures on which effects stand."""

from __future__ import annotations

import pytest

from tests.cases.chain import BAR, CHAIN, load


@pytest.fixture(scope="session")
def chain(tmp_path_factory):
    return load(tmp_path_factory.mktemp("chain"), CHAIN)


@pytest.fixture(scope="session")
def bar(tmp_path_factory):
    return load(tmp_path_factory.mktemp("bar"), BAR)
