"""`vinesexp look`: every column, and what it may be."""

import io
import os
import sys
from itertools import pairwise

import numpy as np
import pytest

from vinesexp.cli import main

RATE, N = 1000.0, 8000
T = np.arange(N) / RATE
RNG = np.random.default_rng(3)
BASE = 0.2 * np.sin(2 * np.pi * 8.0 * T) + 1e-4 * RNG.standard_normal(N)
SWING = 3.0 * np.sin(2 * np.pi * 8.0 * T) * (1.0 + 0.5 * np.sin(2 * np.pi * 0.4 * T))
SHOCKS = np.zeros(N)
SHOCKS[60::125] = 40.0
ACC = -2.5 * SWING + np.convolve(SHOCKS, np.hanning(7), "same") + 0.05 * RNG.standard_normal(N)
W = 2 * np.pi * np.fft.rfftfreq(N, 1.0 / RATE)
LASER = np.fft.irfft(np.fft.rfft(ACC) / np.where(W > 12.0, -(W**2), np.inf), N) * 3000.0
LASER += 1e-3 * RNG.standard_normal(N)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.csv"
    table = np.stack([T, ACC, BASE, LASER], axis=1)
    np.savetxt(path, table, fmt="%.6f", delimiter=",", header="Time (s),P,Q,R", comments="")
    return path


def test_columns_are_reported_with_rate_range_and_peak(file, capsys):
    assert main(["look", str(file)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{file}: text, 8000 rows, 1000 Hz, 8 s"
    assert "0 Time (s) s      times, 0 to 7.999" in lines[1]
    shown = {line.split()[1]: line for line in lines if "strongest at" in line}
    assert set(shown) == {"P", "Q", "R"}
    assert all("strongest at 8 Hz" in line for line in shown.values())


def test_physics_tells_the_channels_apart(file, capsys):
    main(["look", str(file)])
    lines = capsys.readouterr().out.splitlines()
    roles = {
        before.split()[1]: after.split("?")[0].strip()
        for before, after in pairwise(lines)
        if "?" in after
    }
    assert roles == {"P": "acceleration", "Q": "base", "R": "displacement"}


@pytest.mark.long
def test_a_picture_is_drawn_and_none_overwritten(file, tmp_path, capsys):
    picture = tmp_path / "a.png"
    assert main(["look", str(file), "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["look", str(file), "--plot", str(picture)]) == 1
    assert "is there already" in capsys.readouterr().err


def test_a_file_that_cannot_be_read_does_not_stop_the_others(file, tmp_path, capsys):
    (tmp_path / "b.csv").write_text("hello\nworld\n")
    assert main(["look", str(tmp_path / "b.csv"), str(file), str(tmp_path / "c.csv")]) == 1
    printed = capsys.readouterr()
    assert "8000 rows" in printed.out
    assert "no row of numbers" in printed.err
    assert "no such file" in printed.err


@pytest.mark.parametrize("unit", ["lbf", "N", "Pa"])
def test_a_load_cell_or_a_microphone_is_no_displacement(unit, tmp_path, capsys):
    t = np.arange(2000) / 1000.0
    path = tmp_path / "one.csv"
    rows = "\n".join(f"{s:.3f},{x:.6f}" for s, x in zip(t, np.sin(50.0 * t), strict=True))
    path.write_text(f"Time (s),Signal ({unit})\n{rows}\n", encoding="utf-8")
    assert main(["look", str(path)]) == 0
    assert "displacement?" not in capsys.readouterr().out


def test_times_may_stand_in_the_last_of_columns_without_names(tmp_path, capsys):
    t = np.arange(400) / 250.0
    x = np.cos(2 * np.pi * 7.0 * t) + 0.01 * np.random.default_rng(1).standard_normal(t.size)
    np.savetxt(tmp_path / "a.txt", np.stack([x, 0.3 * x, t], axis=1), fmt="%.5f")
    assert main(["look", str(tmp_path / "a.txt")]) == 0
    shown = capsys.readouterr().out
    assert "400 rows, 250 Hz" in shown
    assert "times, 0 to 1.596" in shown


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_any_console_shows_it(encoding, tmp_path, monkeypatch):
    name = tmp_path / "Weg 5 µm → \udcfc.csv"
    t = np.arange(800) / 100.0
    rows = "\n".join(f"{s:.2f},{np.cos(5.0 * s):.5f}" for s in t)
    name.write_text(f"Time (s),Weg → (µm)\n{rows}\n", encoding="utf-8")
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    code = main(["look", os.fspath(name)])
    shown, wrong = (stream.detach().getvalue() for stream in (out, err))
    assert (code, wrong) == (0, b"")
    assert b"strongest at" in shown
    assert b"@" in shown  # for the blocks that such a console does not have


def test_the_picture_has_spectrum_and_phase_plane_of_each_channel(file):
    from vinesexp.commands.look import signals_figure
    from vinesexp.proposal.survey import view_file

    figure = signals_figure([view_file(file)])
    axes = np.array(figure.axes).reshape(3, 3)  # P, Q, R; time, spectrum, phase plane
    for name, (_, spectrum, plane) in zip("PQR", axes, strict=True):
        (line,) = spectrum.lines
        frequency, amplitude = line.get_data()
        assert frequency[np.argmax(amplitude)] == pytest.approx(8.0, abs=0.13)
        (path,) = plane.lines
        signal, rate = path.get_data()
        # The rate is over 2 pi f: a sine is a circle; shocks are faster.
        assert np.std(rate) == pytest.approx(np.std(signal), rel=0.6 if name == "P" else 0.25)
        assert abs(np.corrcoef(signal, rate)[0, 1]) < 0.1
    assert axes[-1][1].get_xlabel() == "frequency (Hz)"
