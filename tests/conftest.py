"""What pytest itself needs for these tests: the option `--update`, and how many models a run built."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

import pytest

from msfp_gen.cli import console
from msfp_gen.jit.cache import MANIFEST_NAME, cache_root

# Before NumPy is imported, here and in what the tests start: threads of BLAS in each of several processes wait for each
# other's cores, and tests of spectra took ten times as long.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_BEFORE = pytest.StashKey[set[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="rewrite tests/golden/msfp.h")


@pytest.fixture(autouse=True)
def no_idle_workers() -> Iterator[None]:
    """Workers of a test do not live on: their processes would not have what the next test changes."""
    yield
    if workers := sys.modules.get("msfp_gen.studies.workers"):
        workers.end_idle()


@pytest.fixture
def update(request: pytest.FixtureRequest) -> bool:
    """Whether tests/golden/msfp.h is rewritten instead of compared."""
    return bool(request.config.getoption("--update"))


def models() -> set[str]:
    """Folders of the models in the cache."""
    return {path.parent.name for path in cache_root().glob(f"msfp_*/{MANIFEST_NAME}")}


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_BEFORE] = models()
    console.EVERY = 1e6  # a slow machine prints no line of progress more than a fast one


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Building models takes most of the time of a run with an empty cache."""
    terminalreporter.write_line(f"models built: {len(models() - config.stash[_BEFORE])}")
