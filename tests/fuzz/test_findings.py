"""What the long rounds found, each cut down to the least that showed it."""

from contextlib import suppress

import numpy as np
import pytest

from vinesexp.errors import RecordError, VinesexpError, shown
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import campaign_problems
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.signals.channel_agreement import compare_channels

LASER = Channel("displacement", 1, "displacement", 1e-3, unit="mm")

#: Text files, each cut down to the least that was answered with a traceback.
TEXTS = {
    "an open quote, and no row left": b'"\n2',
    "settings beside rows that are wider than the first": b"e,V\nt,,3,2\n4\n,3,6\n5",
    "a lone return among settings beside the rows": b"9,,3,0\n9,,,\x1a\r[",
    "returns inside quotes": b'a,b\n1,2\n3,"4\r5"\r6\n',
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_file_is_looked_at_and_refused_in_a_line(name, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(TEXTS[name])
    with suppress(RecordError):
        view_file(path)
    for time in (None, TimeColumn(0, "s", 1.0)):
        with pytest.raises(RecordError):
            read_channels(path, Setup({"displacement": LASER}, time=time))


def test_a_message_holds_nothing_that_a_console_obeys(tmp_path):
    (tmp_path / "campaign.yaml").write_text("channels: {}\n", encoding="utf-8")
    table = "record,file,test,\x1b[2J\x00\na,b,c,d\n"
    (tmp_path / "records.csv").write_text(table, encoding="utf-8")
    reported = [str(problem) for problem in campaign_problems(tmp_path)]
    assert any(r"'\x1b[2J\x00'" in line for line in reported)
    assert all(line.isprintable() for line in reported)


def test_a_file_name_that_no_file_can_have_is_reported(tmp_path):
    long = "x" * 5000
    channels = "channels: {displacement: {column: 1, quantity: displacement, unit: mm}}\n"
    (tmp_path / "campaign.yaml").write_text(f"{channels}published: {long}\n", encoding="utf-8")
    table = f"record,file,test\na,{long}.csv,ringdown\n"
    (tmp_path / "records.csv").write_text(table, encoding="utf-8")
    reported = [str(problem) for problem in campaign_problems(tmp_path)]
    assert any("key published: found 'xxx" in line for line in reported)
    assert any("column file" in line for line in reported)
    assert all(len(line) < 1000 for line in reported)


def test_a_name_that_is_no_text_can_be_printed():
    error = VinesexpError("is missing", file="raw/\udcff\n.csv")
    assert str(error) == r"raw/\udcff\n.csv: is missing"
    assert len(shown("x" * 200_000)) < 400


def test_a_dead_accelerometer_agrees_with_nothing():
    t = np.arange(4000) / 1000.0
    x = 1e-3 * np.cos(2.0 * np.pi * 7.9 * t)
    assert compare_channels(np.zeros(t.size), x, 1e-3, frequency=7.9) is None
