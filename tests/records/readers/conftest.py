"""What tests of the readers share."""

import pytest

from vinesexp.records.readers import guard


@pytest.fixture
def one_thread(monkeypatch):
    """Files are read in forks of this process, into which readers go that stand in no module."""
    monkeypatch.setattr(guard, "threads", lambda: 1)
