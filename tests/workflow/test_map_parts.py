"""A large map in parts: the same map as in one piece, and mistakes in one line."""

from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from tests.workflow import forked

from vinesexp.cli import main
from vinesexp.maps.response_map import read_map

pytestmark = pytest.mark.workflow
REPOSITORY = Path(__file__).resolve().parents[2]

CONFIG = """\
out: {out}
parts: 2
options:
  mass: 4.7 kg
  damping: 3.02 N s/m
  stiffness: 1.147e4 N/m
  nes-mass: 32 g
  restitution: 0.6
  clearance: 20:30 mm
  base-amplitude: 0.2:0.25 mm
  cells: 2x3
  starts: 1
"""


def run(folder: Path, *more: str) -> CompletedProcess[str]:
    smk = str(REPOSITORY / "workflow" / "map.smk")
    return forked.start(("-s", smk, "-c1", "--workflow-profile", "none", *more), folder).ended()


@pytest.mark.slow
def test_parts_make_the_map_of_one_piece(tmp_path: Path) -> None:
    out = tmp_path / "maps" / "two.nc"
    (tmp_path / "map.yaml").write_text(CONFIG.format(out=out), encoding="utf-8")
    done = run(tmp_path, "--configfile", "map.yaml")
    assert done.returncode == 0, done.stderr
    options = ["--mass", "4.7 kg", "--damping", "3.02 N s/m", "--stiffness", "1.147e4 N/m",
               "--nes-mass", "32 g", "--restitution", "0.6", "--clearance", "20:30 mm",
               "--base-amplitude", "0.2:0.25 mm", "--cells", "2x3", "--starts", "1"]  # fmt: skip
    assert main(["map", *options, "--out", str(tmp_path / "whole.nc")]) == 0
    np.testing.assert_array_equal(
        read_map(out).mean_amplitude, read_map(tmp_path / "whole.nc").mean_amplitude
    )
    assert out.with_suffix(".svg").is_file()


@pytest.mark.long
def test_a_setting_that_is_none_is_one_line(tmp_path: Path) -> None:
    wrong = run(tmp_path, "-n", "--config", "outs=x")
    assert wrong.returncode != 0
    assert "vinesexp map: found the settings outs, expected out and options" in wrong.stderr
