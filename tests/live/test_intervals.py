"""Values and their intervals while records arrive."""

import json
import re

import pytest
from benchmarks.watching import record_text

from vinesexp.figures.identified_values import intervals_over_records
from vinesexp.live.server import parts_of
from vinesexp.live.session import Session

NAMES = ("M", "c1", "k1", "r")
TRUE = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6}
FIRST = {
    "ring_1": {"release": 0.02, "seconds": 6.0},
    "ring_2_400g": {"release": 0.02, "mass": 0.4, "seconds": 6.0},
    "s_b30": {"b": 0.030, "G": 2.5e-4, "wait": 20.0},
}
THEN = {
    "ring_3": {"release": 0.02, "seconds": 6.0},
    "ring_4_400g": {"release": 0.02, "mass": 0.4, "seconds": 6.0},
    "s_b32": {"b": 0.032, "G": 2.5e-4, "wait": 20.0},
    "s_b28": {"b": 0.028, "G": 2.5e-4, "wait": 20.0},
    "s_b26": {"b": 0.026, "G": 2.5e-4, "wait": 20.0},
}


def shown(session: Session) -> dict[str, tuple[float, float]]:
    """Value and half interval of each parameter, as the page has them."""
    markup = re.sub(r"</?su[bp]>", "", parts_of(session)["campaign"])
    found = {}
    for name in NAMES:
        (cell,) = re.findall(rf"<td><b>{name}</b>.*?</td><td>(.*?)</td>", markup)
        value, half = re.match(r"([\d.]+) ± ([\d.]+)", cell).groups()
        found[name] = float(value), float(half)
    return found


@pytest.mark.long
def test_intervals_are_narrower_after_eight_records_than_after_three(bench, tmp_path):
    session = Session(bench, tmp_path / "results", quiet=0.2)
    session.begin()
    pages = []
    for files in (FIRST, THEN):
        for seed, (name, test) in enumerate(files.items()):
            text = record_text(**test, rate=2_000.0, seed=seed + len(files))
            (bench / f"raw/{name}.csv").write_text(text)
        session.settle()
        pages.append(shown(session))
    three, eight = pages
    session.stop()
    for name in NAMES:
        assert eight[name][1] < three[name][1], name
        for value, half in (three[name], eight[name]):
            assert abs(value - TRUE[name]) < half, name
    # Their figure: half of the interval in percent of the value, over the number of records.
    figure = session.status.campaign.figures[-1]
    assert figure[1].startswith("Half of the 95 % interval of each value, in percent of the value")
    history = json.loads((tmp_path / "results/finished/values.json").read_text())
    (axis,) = intervals_over_records(history).axes
    assert len(axis.lines) == len(NAMES)
    for name, line in zip(NAMES, axis.lines, strict=True):
        percent = dict(zip(*line.get_data(), strict=True))
        for page, records in ((three, 3), (eight, 8)):
            value, half = page[name]
            assert percent[records] == pytest.approx(100.0 * half / value, rel=0.05)
