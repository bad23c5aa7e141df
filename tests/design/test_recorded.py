"""A base as it was recorded: peak and rms, by the solver's own motions; the command on a file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import vinesexp
from vinesexp import NES, Measured, Oscillator, Release, Rig, simulate
from vinesexp.cli import main
from vinesexp.design import recorded

HOST = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
RIG = {"mass": 4.7, "damping": 3.02, "stiffness": 1.147e4, "nes_mass": 0.1, "restitution": 0.6}


@pytest.fixture
def quake(monkeypatch: pytest.MonkeyPatch) -> Measured:
    """Filtered noise around the natural frequency that swells and dies, 6 s at 200 Hz."""
    monkeypatch.setattr(recorded, "CLEARANCES", 6)
    monkeypatch.setattr(recorded, "STARTS", 3)
    t = np.arange(1200) / 200.0
    rng = np.random.default_rng(5)
    motion = sum(
        np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in np.linspace(6.0, 10.0, 9)
    )
    return Measured(0.3e-3 * np.sin(np.pi * t / 6.0) ** 2 * np.asarray(motion), 200.0)


def test_what_is_printed_is_the_motion(quake: Measured) -> None:
    answer = vinesexp.design(**RIG, base=quake, tolerance=0)
    found = answer.driven
    assert found is not None
    best = found.found[found.least_rms]
    rig = Rig(HOST, [NES(m=0.1, b=best.b, r=0.6)])
    motion = simulate(rig, quake, Release(y0=[best.b]), quake.duration)
    t = np.linspace(0.0, quake.duration, 20_001)
    z = motion.at(t)[0] - motion.base(t)[0]
    walled = best.rms[recorded.FRESH]
    assert walled == pytest.approx(np.sqrt(np.mean(z**2)), rel=5e-3)
    assert best.peak[recorded.FRESH] == pytest.approx(np.abs(z).max(), rel=1e-2)
    assert np.median(best.rms) < 0.8 * found.bare.rms[0]
    assert answer.headline.startswith("Under the recorded base (5.995 s, peak ")
    assert "least rms" in answer.text()


def test_a_record_in_a_file(
    quake: Measured, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples = 1e3 * np.asarray(quake.samples)
    rows = [f"{i / 200.0:.3f},{x:.6f}" for i, x in enumerate(samples)]
    file = tmp_path / "quake.csv"
    file.write_text("Time,Base\ns,mm\n" + "\n".join(rows) + "\n", encoding="utf-8")
    words = [
        "design", "--mass", "4.7 kg", "--damping", "3.02 N s/m", "--stiffness", "1.147e4 N/m",
        "--nes-mass", "100 g", "--restitution", "0.6", "--base", str(file),
    ]  # fmt: skip
    assert main([*words, "--base-column", "Base", "--base-unit", "mm", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["recorded"]["base_peak_mm"] == pytest.approx(np.abs(samples).max(), rel=1e-4)
    assert answer["recorded"]["bare"]["rms_mm"] > answer["recorded"]["clearances"][0]["rms_mm"] / 2
    assert answer["robust_mm"] is None
    assert main(words) == 1
    assert "the unit of the record is missing" in capsys.readouterr().err
    assert main([*words[:-2], "--base-unit", "mm"]) == 1
    assert "name its file with --base" in capsys.readouterr().err


def test_an_interrupt_leaves_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vinesexp.design.ask.advise", stop)
    answer = vinesexp.design(**RIG, base_amplitude=0.25e-3)
    assert answer.stopped
    assert answer.advice is None
    assert answer.theory.b_c is not None
    assert "stopped before its end" in answer.headline
