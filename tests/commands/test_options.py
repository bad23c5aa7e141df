"""What commands share: nothing that is there is written over, whatever the command."""

from pathlib import Path

import pytest

from vinesexp.cli import main
from vinesexp.commands.options import refuse_existing
from vinesexp.errors import VinesexpError

RIG = ["--mass", "4.7 kg", "--damping", "3.02 N s/m", "--stiffness", "1.147e4 N/m",
       "--nes-mass", "32 g", "--restitution", "0.6", "--base-amplitude", "0.25 mm"]  # fmt: skip
BASINS = ["basins", *RIG, "--clearance", "20 mm"]
MAP = ["map", *RIG, "--clearance", "20:30 mm", "--frequency", "7.8:7.9 Hz"]


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ([*BASINS, "--starts", "1"], "--out"),
        (BASINS, "--plot"),
        (MAP, "--plot"),
        (["design", *RIG, "--theory-only"], "--html"),
        (["plan", *RIG], "--records"),
        (["compare", ".", "."], "--csv"),
        (["compare", ".", "."], "--html"),
        (["look", "raw.csv"], "--plot"),
    ],
)
def test_a_file_that_is_there_stays_as_it_is(command, option, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    there = Path({"--plot": "there.svg", "--html": "there.html"}.get(option, "there.csv"))
    there.write_text("measured", encoding="utf-8")
    assert main([*command, option, str(there)]) == 1
    assert "there already" in capsys.readouterr().err
    assert there.read_text(encoding="utf-8") == "measured"


def test_force_writes_over_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    there = Path("there.csv")
    there.write_text("measured", encoding="utf-8")
    assert main([*BASINS, "--starts", "1", "--out", str(there), "--force"]) == 0
    assert there.read_text(encoding="utf-8").startswith("b_m,")


def test_a_new_file_is_no_trouble(tmp_path):
    refuse_existing(tmp_path / "new.csv", None)
    with pytest.raises(VinesexpError, match="is there already"):
        refuse_existing(None, tmp_path)
