"""A day of 200 records: each is taken once, its words come first, and nothing is done again."""

import pytest
from benchmarks.watching import YAML, day_of_files, record_text

from vinesexp.live.server import parts_of
from vinesexp.live.session import Session

RECORDS = 200


@pytest.mark.slow
def test_a_day_of_200_records(tmp_path, monkeypatch):
    raw = tmp_path / "bench/raw"
    raw.mkdir(parents=True)
    (tmp_path / "bench/campaign.yaml").write_text(YAML)
    session = Session(tmp_path / "bench", tmp_path / "results", quiet=0.1)
    analysed, identified = [], []
    real = session._analyse
    monkeypatch.setattr(
        session, "_analyse", lambda record: (analysed.append(record.id), real(record))
    )
    begin = session.identifying.begin
    monkeypatch.setattr(
        session.identifying, "begin", lambda *given: (identified.append(given), begin(*given))
    )
    session.begin()
    views = []
    for number, (name, test) in enumerate(day_of_files(RECORDS), start=1):
        (raw / name).write_text(record_text(**test, seconds=6.0, seed=number))
        while len(session.seen) < number or session.seen[session.status.newest].state != "done":
            session.step()
        assert session.status.newest == name.removesuffix(".csv")
        assert len(analysed) == number  # this one, and none of those before
        assert session.status.newest in parts_of(session)["record"]
        if session.status.campaign not in views[-1:]:
            views.append(session.status.campaign)
    session.settle(3600.0)
    assert len(set(analysed)) == RECORDS
    # The campaign as a whole came late, and not once a record.
    assert len(views) < RECORDS
    assert len(identified) < RECORDS
    view = session.status.campaign
    assert view.records == view.identified_from == RECORDS
    values = {row["name"]: row for row in view.parameters}
    assert {"M", "c1", "k1", "r"} <= set(values)
    session.stop()
