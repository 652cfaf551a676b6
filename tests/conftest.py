"""What all tests share: the document, its declarations, and what was found of it."""

from __future__ import annotations

import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from yarnverify.library import MAIN_DOCUMENT, derivations, shelf_for
from yarnverify.source import Source, load

settings.register_profile(
    "ci", derandomize=True, deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("ci")

# Coverage is asked of ``symbolic``. To trace a test makes it two or three times as slow, so not all are traced but those files
# that between them go everywhere there; the others (proofs, mutants, repairs) go the same ways many times.
TRACED = (
    "cli", "declare", "derive", "document", "export", "first_energies", "forward", "library", "normal", "output", "own",
    "reader", "rewritings", "sides", "vector_angles",
)  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Traces no file but those; the marker ``no_cover`` of pytest-cov does nothing in the workers of pytest-xdist."""
    trace = sys.gettrace()
    if item.path.stem.removeprefix("test_") not in TRACED:
        sys.settrace(None)
    try:
        return (yield)
    finally:
        sys.settrace(trace)


@pytest.fixture(scope="module", autouse=True)
def nothing_is_left_to_import(tmp_path_factory: pytest.TempPathFactory) -> Generator[None]:
    """A module or a search path of one file's temporary folders would be found by the next file, or not, by their order."""
    yield
    places = {name: str(getattr(module, "__file__", None)) for name, module in sys.modules.items()}
    places |= {f"sys.path: {place}": place for place in sys.path}
    base = tmp_path_factory.getbasetemp()
    assert [name for name, place in places.items() if Path(place).is_relative_to(base)] == []


@pytest.fixture(scope="session")
def folder() -> Path:
    return derivations()


@pytest.fixture(scope="session")
def source(folder: Path) -> Source:
    return load(folder / MAIN_DOCUMENT)


@pytest.fixture(scope="session")
def declarations(folder: Path) -> Any:
    from yarnverify.symbolic.declare import load_declarations

    return load_declarations(folder)


@pytest.fixture(scope="session")
def record(source: Source) -> dict[str, Any]:
    """The record of the main document, worked out afresh."""
    from yarnverify.symbolic.record import prove_source

    return prove_source(source, shelf_for(Path(source.name), source.text))
