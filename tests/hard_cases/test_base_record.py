"""Measured base motions that cannot be: each is one line that says file, found and expected."""

import numpy as np
import pytest

from vinesexp.errors import CampaignError, RecordError, VinesexpError
from vinesexp.laboratory.scene import load_scene, simulate_group

SCENE = """\
seed: 3
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m}
sensors: {displacement: {sensitivity: 40 mV/mm}}
oscilloscope: {sample_rate: 1 kHz}
groups:
  driven:
    records:
      one: {test: sweep, duration: 2 s, base_record: {file: base.csv, column: 1, unit: mm,
            time: {column: 0, unit: s}}}
"""


def rows(values, dt=1e-3):
    return "".join(f"{n * dt:.6f},{value}\n" for n, value in enumerate(values))


def simulated(folder, content, text=SCENE):
    (folder / "scene.yaml").write_text(text, encoding="utf-8")
    (folder / "base.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    return simulate_group(load_scene(folder / "scene.yaml"), "driven", folder)


GOOD = [f"{x:.9f}" for x in 0.25 * np.sin(2 * np.pi * 7.8e-3 * np.arange(2001))]
HOLE = [*GOOD[:700], "nan", *GOOD[701:]]
WRONG = [
    ("Time (s),x (mm)\n" + rows(GOOD[:1900]), "lasts 1.899 s, test 'one' runs for 2 s"),
    ("Time (s),x (mm)\n" + rows(GOOD[:3]), "lasts 0.002 s, test 'one' runs for 2 s"),
    (b"", "is empty; export the record again"),
    ("Time (s),x (mm)\n", ""),
    ("Time (s),x (V)\n" + rows(GOOD), "the header says 'V', a unit of voltage"),
    ("Time (s),x (um)\n" + rows(GOOD), "in base_record of scene.yaml correct the unit of base"),
    ("Time (s),x (mm)\n" + rows(HOLE), "NaN among the samples"),
    ("Time (s),x (mm)\n" + rows(["inf" if n == 9 else x for n, x in enumerate(GOOD)]), "infinite"),
    ("Time (s),x (mm)\n" + rows(["abc" if n == 9 else x for n, x in enumerate(GOOD)]), "abc"),
    ("Time (s)\n" + "".join(f"{n * 1e-3}\n" for n in range(2001)), "no column 1"),
    (b"PK\x03\x04" + bytes(100), "zip"),
]


@pytest.mark.parametrize(("content", "message"), WRONG)
def test_a_bad_file_is_reported_in_one_line(tmp_path, content, message):
    with pytest.raises(RecordError) as error:
        simulated(tmp_path, content)
    text = str(error.value)
    assert "base.csv" in text
    assert message.lower() in text.lower()
    assert "\n" not in text
    assert "campaign.yaml" not in text
    assert "channels." not in text
    assert not list(tmp_path.glob("raw/*"))  # nothing half-made


def test_the_good_one_is_simulated(tmp_path):
    (made,) = simulated(tmp_path, "Time (s),x (mm)\n" + rows(GOOD))
    assert made.stat().st_size > 1000


def test_a_start_beyond_the_record_is_reported(tmp_path):
    text = SCENE.replace("unit: mm", "unit: mm, start: 5 s")
    with pytest.raises(RecordError, match=r"lasts 0 s after its start at 5 s, test 'one' runs"):
        simulated(tmp_path, "Time (s),x (mm)\n" + rows(GOOD), text)


def test_a_file_without_times_needs_a_sample_rate(tmp_path):
    text = SCENE.replace("column: 1", "column: 0").replace("time: {column: 0, unit: s}", "")
    column = "x (mm)\n" + "".join(f"{x}\n" for x in GOOD)
    with pytest.raises(RecordError, match=r"in base_record of scene.yaml give .* 'sample_rate'$"):
        simulated(tmp_path, column, text)
    simulated(tmp_path, column, text.replace("column: 0", "column: 0, sample_rate: 1 kHz"))


def test_both_clocks_are_one_too_many(tmp_path):
    text = SCENE.replace("column: 1", "column: 1, sample_rate: 1 kHz")
    with pytest.raises(CampaignError, match="both 'time' and 'sample_rate'"):
        simulated(tmp_path, "", text)


def test_another_file_is_not_overwritten(tmp_path):
    from vinesexp.commands.simulate import write_description

    simulated(tmp_path, "Time (s),x (mm)\n" + rows(GOOD))
    out = tmp_path / "out"
    out.mkdir()
    (out / "base.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(VinesexpError, match="differs from"):
        write_description(tmp_path / "scene.yaml", out)
    assert (out / "base.csv").read_text(encoding="utf-8") == "mine"
