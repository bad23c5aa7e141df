"""A small bench: the files of a simulated campaign, to be dropped into a folder one by one."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.watching import YAML, record_text


@pytest.fixture(scope="session")
def texts() -> dict[str, str]:
    """What an instrument writes in half a day."""
    return {
        "ring_1.csv": record_text(release=0.02, seconds=6.0, seed=1),
        "ring_2_400g.csv": record_text(release=0.02, mass=0.4, seconds=6.0, seed=2),
        "s_b30.csv": record_text(b=0.030, G=2.5e-4, wait=20.0, seed=3),
        "s_b32.csv": record_text(b=0.032, G=2.5e-4, wait=20.0, seed=4),
        "unnamed.csv": record_text(b=0.036, G=2.5e-4, wait=20.0, seconds=6.0, seed=5),
    }


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """A campaign folder with its description and no record."""
    folder = tmp_path / "bench"
    (folder / "raw").mkdir(parents=True)
    (folder / "campaign.yaml").write_text(YAML)
    return folder
