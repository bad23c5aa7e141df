"""A base as it was recorded: peak and rms, by the solver's own motions; the command on a file."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

import vinesexp
from vinesexp import NES, Measured, Oscillator, Release, Rig, simulate
from vinesexp.cli import main
from vinesexp.commands.design import base_of
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


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
def test_where_a_sensor_has_its_zero_is_no_motion(quake: Measured) -> None:
    samples, rate = np.asarray(quake.samples), quake.sample_rate
    plain = vinesexp.design(**RIG, base=quake).driven
    still = np.concatenate([np.zeros(40), samples])
    at_zero, off = (vinesexp.design(**RIG, base=Measured(x, rate)) for x in (still, still + 0.05))
    assert plain is not None
    assert off.driven is not None
    assert at_zero.driven is not None
    assert off.driven.rest == pytest.approx(0.05, rel=1e-9)
    assert off.driven.base_peak == pytest.approx(np.abs(samples).max(), rel=1e-9)
    assert off.driven.bare.peak[0] == pytest.approx(plain.bare.peak[0], rel=1e-2)
    assert [one.b for one in off.driven.found] == pytest.approx(
        [one.b for one in at_zero.driven.found], rel=1e-6
    )
    assert off.notes == [*at_zero.notes, "the base record shows 50 mm before it moves, which was "
                         "taken off"]  # fmt: skip


def test_a_record_that_begins_in_motion_has_its_mean_at_zero(quake: Measured) -> None:
    t = np.arange(1200) / 200.0
    turn = Measured(0.05 + 0.3e-3 * np.cos(2.0 * np.pi * 5.0 * t), 200.0)
    answer = vinesexp.design(**RIG, base=turn)
    found = answer.driven
    assert found is not None
    assert found.rest == pytest.approx(0.05, abs=1e-6)
    assert found.base_rms == pytest.approx(0.3e-3 / np.sqrt(2.0), rel=1e-3)
    bare = simulate(
        Rig(HOST), Measured(np.asarray(turn.samples) - found.rest, 200.0), Release(x0=0.3e-3), 5.995
    )
    ends = np.linspace(0.0, 5.995, 20_001)
    z = bare.at(ends)[0] - bare.base(ends)[0]
    assert z[0] == pytest.approx(0.0, abs=1e-6)
    assert found.bare.rms[0] == pytest.approx(np.sqrt(np.mean(z**2)), rel=5e-3)
    assert any("begins at rest and undeflected" in note for note in answer.notes)


@pytest.mark.long
def test_a_ball_that_friction_holds_is_compared_with_its_mass(quake: Measured) -> None:
    t = np.arange(1200) / 200.0
    w = 2.0 * np.pi * HOST.f0
    base = Measured(0.1e-3 * np.sin(np.pi * t / 6.0) ** 2 * np.sin(w * t), 200.0)
    answer = vinesexp.design(**RIG, base=base, friction=500.0)
    found = answer.driven
    assert found is not None
    heavier = Rig(Oscillator(M=4.8, c1=3.02, k1=1.147e4))
    motion = simulate(heavier, base, duration=base.duration)
    ends = np.linspace(0.0, base.duration, 20_001)
    rms = float(np.sqrt(np.mean((motion.at(ends)[0] - motion.base(ends)[0]) ** 2)))
    assert found.fixed.rms[0] == pytest.approx(rms, rel=5e-3)
    assert found.beats(found.bare)
    assert np.median(found.found[found.least_rms].rms) == pytest.approx(rms, rel=5e-3)
    assert found.hopeless
    assert f"oscillator, without a cavity: rms {1e3 * found.fixed.rms[0]:.3g} mm" in answer.headline
    assert not vinesexp.design(**RIG, base=quake).driven.as_fixed


@pytest.mark.parametrize(
    ("samples", "rate", "words"),
    [
        (np.zeros(100), 200.0, "base record: is 0 mm from its first sample to its last"),
        (np.sin(np.arange(100.0)), 10.0, "oscillator of 7.862 Hz needs 31.45 Hz or more"),
    ],
)
def test_a_record_that_cannot_tell_is_refused(samples: np.ndarray, rate: float, words: str) -> None:
    with pytest.raises(vinesexp.VinesexpError, match=words):
        vinesexp.design(**RIG, base=Measured(1e-3 * samples, rate))


def test_the_column_of_a_file_is_a_displacement_or_a_velocity(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t = np.arange(1200) / 200.0
    w = 2.0 * np.pi * 7.0
    moved = 0.3 * np.sin(np.pi * t / 6.0) ** 2 * np.sin(w * t)
    file = tmp_path / "base.csv"
    rows = zip(1e3 * t, moved, np.gradient(moved, t), strict=True)
    body = "\n".join(f"{time:.1f},{x:.7f},{v:.6f}" for time, x, v in rows)
    file.write_text(f"Time (ms),Base,Speed\n{body}\n", encoding="utf-8")

    def peak(column: str, unit: str) -> float:
        arguments = argparse.Namespace(base=file, base_column=column, base_unit=unit)
        base = base_of(arguments)
        assert base is not None
        assert base.sample_rate == pytest.approx(200.0)  # the header's own unit of time
        return float(np.abs(np.asarray(base.samples)).max())

    assert peak("Base", "mm") == pytest.approx(1e-3 * np.abs(moved).max(), rel=1e-6)
    assert peak("Speed", "mm/s") == pytest.approx(peak("Base", "mm"), rel=0.02)
    with pytest.raises(vinesexp.VinesexpError, match="--base-unit: 'g' is a unit of acceleration"):
        peak("Speed", "g")
    file.write_text("Base\n" + "\n".join(f"{x:.7f}" for x in moved), encoding="utf-8")
    with pytest.raises(vinesexp.VinesexpError, match=r"no times: .*there is 'Base'"):
        peak("0", "mm")


def test_an_interrupt_leaves_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vinesexp.design.ask.advise", stop)
    answer = vinesexp.design(**RIG, base_amplitude=0.25e-3)
    assert answer.stopped
    assert answer.advice is None
    assert answer.theory.b_c is not None
    assert "stopped before its end" in answer.headline
