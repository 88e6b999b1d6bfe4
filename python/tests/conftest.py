"""What the tests are run on."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def repository() -> Path:
    """The repository whose documents and studies are tried; the package itself is the installed one."""
    return Path(os.environ.get("ASID_REPOSITORY", Path(__file__).parents[2]))
