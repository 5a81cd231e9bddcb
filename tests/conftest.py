"""One thread for linear algebra (set before numpy loads: two workers with two threads each are
slower than with one), one process for refits, and the real recordings."""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["CVXUPDATE_JOBS"] = "1"  # workers of the tests are as many as there are processors

import gc  # noqa: E402
import sys  # noqa: E402
from collections.abc import Iterator  # noqa: E402
from pathlib import Path  # noqa: E402

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402
from hypothesis.internal.conjecture import providers  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))


# `make test` draws the same examples every time; `make fuzz` draws new ones, and more of them.
settings.register_profile("test", derandomize=True)
settings.register_profile("fuzz", derandomize=False, max_examples=2000, deadline=None)
PROFILE = os.environ.get("CVXUPDATE_FUZZ", "test")
settings.load_profile(PROFILE)
if PROFILE == "test" and hasattr(providers, "_get_local_constants"):
    # Newer versions of hypothesis also draw what stands as a constant in those files of the package
    # that are loaded by then: examples would depend on the tests that a worker did before.
    providers._get_local_constants = lambda: providers.Constants()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Iterator[None]:
    """Hundreds of thousands of objects of 370 files, which stay to the end: looking through them
    for garbage is a fifth of the time of collecting them, and would come again in the tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long ones first: a worker that began one last would be waited for."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture(autouse=True, scope="session")
def _no_hurry() -> Iterator[None]:
    """What is found is asked here, not how fast this machine is: four times what a diagnosis may
    take, so that a slow one decides as a quick one does."""
    from cvxupdate.diagnose import budget
    from cvxupdate.diagnose.search import guided

    with pytest.MonkeyPatch.context() as patch:
        for module, name in ((budget, "BUDGET"), (budget, "WALL"), (guided, "BUDGET")):
            patch.setattr(module, name, 4.0 * getattr(module, name))
        yield


@pytest.fixture
def data_folder() -> Path:
    """The folder CVXUPDATE_DATA with the real recordings; a test that needs it is skipped by name
    where it is not there."""
    folder = os.environ.get("CVXUPDATE_DATA", "")
    if not folder or not Path(folder).is_dir():
        pytest.skip("CVXUPDATE_DATA names no folder: the real recordings are not tested")
    return Path(folder)
