"""A small bench: the files of a simulated campaign, to be dropped into a folder one by one."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vinesexp import NES, Oscillator, Release, Rig, simulate
from vinesexp.excitation import Harmonic

RIG = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
YAML = """\
title: At the bench
known: {nes_mass: 32 g}
channels:
  base: {column: "Base*", quantity: displacement, unit: mm, optional: yes}
  displacement: {column: "Laser*", quantity: displacement, unit: mm}
  acceleration: {column: "Acc*", quantity: acceleration, unit: m/s^2}
time: {column: "Time*", unit: s}
"""
RATE = 2000.0


def record_text(
    *, b: float | None = None, G: float = 0.0, release: float = 0.0, mass: float = 0.0,
    seconds: float = 4.0, wait: float = 0.0, seed: int = 0,
) -> str:  # fmt: skip
    """A record of the published rig as a logger would write it: exact motion, noise, pulses."""
    rng = np.random.default_rng(seed)
    host = Oscillator(M=RIG.M + mass, c1=RIG.c1, k1=RIG.k1)
    rig = Rig(host, nes=[NES(m=0.032, b=b, r=0.6)] if b else [])
    drive = Harmonic(amplitude=G, frequency=7.862) if G else None
    start = Release(x0=release, y0=[release - 0.999 * b] if b else [])
    motion = simulate(rig, drive, start, duration=wait + seconds)
    t = np.arange(round(seconds * RATE)) / RATE
    x, v = motion.at(wait + t)
    base = G * np.sin(2.0 * np.pi * 7.862 * (wait + t))
    speed = G * 2.0 * np.pi * 7.862 * np.cos(2.0 * np.pi * 7.862 * (wait + t))
    a = -(host.c1 * (v - speed) + host.k1 * (x - base)) / host.M
    hits = motion.impacts
    width = 2.5e-3
    for s, jump in zip(hits["time"] - wait, hits["v_after"] - hits["v_before"], strict=True):
        near = abs(t - s) < width
        a[near] += jump * (0.25 * np.pi / width) * np.cos(0.5 * np.pi * (t[near] - s) / width)
    rows = np.column_stack([
        t, 1e3 * base + 1e-4 * rng.standard_normal(t.size),
        1e3 * x + 1e-3 * rng.standard_normal(t.size), a + 0.05 * rng.standard_normal(t.size),
    ])  # fmt: skip
    lines = "\n".join(f"{p:.4f},{q:.5f},{r:.5f},{s:.3f}" for p, q, r, s in rows)
    return f"Time (s),Base (mm),Laser (mm),Acc (m/s^2)\n{lines}\n"


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


@pytest.fixture
def browser_of() -> Any:
    """The class of a browser; skipped where there is no Chromium."""
    spec = importlib.util.spec_from_file_location(
        "browser_of_live", Path(__file__).parent / "browser.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules.setdefault(spec.name, importlib.util.module_from_spec(spec))
    if not hasattr(module, "Browser"):
        spec.loader.exec_module(module)
    if module.CHROMIUM is None:
        pytest.skip("needs Chromium")
    return module.Browser
