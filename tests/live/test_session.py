"""A day at the bench: files as instruments and people leave them; corrections; a second day."""

import csv
import os
import re
import shutil
from pathlib import Path

import pytest

from vinesexp.errors import CampaignError
from vinesexp.live.server import parts_of
from vinesexp.live.session import ChangedMeanwhileError, Session
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths


def rows(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "records.csv").open(newline="") as stream:
        return {row["record"]: row for row in csv.DictReader(stream)}


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a campaign but its table."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "records.csv"
    }


@pytest.fixture
def session(bench, tmp_path):
    found = Session(bench, tmp_path / "results", quiet=0.2)
    yield found
    found.stop()


def test_a_folder_without_description_is_one_line(tmp_path):
    with pytest.raises(CampaignError, match="vinesexp init"):
        Session(tmp_path, tmp_path / "results").begin()


@pytest.mark.long
def test_a_day_of_files_as_they_come(bench, session, texts, tmp_path):
    raw = bench / "raw"
    session.begin()
    assert rows(bench) == {}
    # Written slowly: nothing is taken before its end.
    whole = texts["s_b32.csv"]
    for k in range(1, 4):
        (raw / "s_b32.csv").write_text(whole[: len(whole) * k // 4])
        session.step()
        assert rows(bench) == {}
    (raw / "s_b32.csv").write_text(whole)
    # Out of order, of a drive whose clock is decades off, and renamed from what a logger writes to.
    (raw / "ring_2_400g.csv").write_text(texts["ring_2_400g.csv"])
    os.utime(raw / "ring_2_400g.csv", (4e9, 4e9))
    (raw / "s_b30.csv.part").write_text(texts["s_b30.csv"])
    (raw / "ring_1.csv").write_text(texts["ring_1.csv"])
    os.utime(raw / "ring_1.csv", (0, 0))
    session.settle()
    (raw / "s_b30.csv.part").rename(raw / "s_b30.csv")
    # Without a name that says it, its clearance is in its flights.
    (raw / "unnamed.csv").write_text(texts["unnamed.csv"])
    # One twice, one cut within a line, one of something else.
    shutil.copy(raw / "ring_1.csv", raw / "copy of ring_1.csv")
    (raw / "cut_b32.csv").write_text(whole[: len(whole) // 2 + 7])
    (raw / "no_record.csv").write_text("name,phone\nAda,1\n")
    session.settle()
    before = contents(bench)
    table = rows(bench)
    assert set(table) == {"s_b32", "ring_2_400g", "ring_1", "s_b30", "unnamed", "cut_b32"}
    assert {id: row["test"] for id, row in table.items() if id != "cut_b32"} == {
        "s_b32": "periodic", "s_b30": "periodic", "unnamed": "periodic",
        "ring_1": "ringdown", "ring_2_400g": "ringdown",
    }  # fmt: skip
    assert table["ring_2_400g"]["added_mass_g"] == "400"
    # what the base channel shows is not written as if the shaker had been set to it
    assert not any(row.get("base_amplitude_mm") for row in table.values())
    assert float(table["unnamed"]["clearance_mm"]) == pytest.approx(36.0, abs=0.1)
    assert "from its flights" in table["unnamed"]["note"]
    assert "has the same content as ring_1.csv" in session.status.remarks["raw/copy of ring_1.csv"]
    assert "raw/no_record.csv" in session.status.remarks
    assert all(seen.state == "done" for seen in session.seen.values())
    assert session.status.campaign.records == 6
    steps = {step.name for step in session.status.campaign.steps}
    assert "ring-downs" in steps
    assert any(name.startswith("G = 0.2") for name in steps)
    assert contents(bench) == before  # raw files are never touched
    parts = parts_of(session)
    assert "What to test next" in parts["next"]
    assert "Test log, tested by the records" in parts["campaign"]
    assert not re.search(r"<th[^>]*></th>", "".join(parts.values()))  # nameless to a reader aloud
    # The same files come out as of a run on the finished folder.
    once = ResultPaths(tmp_path / "once")
    analyse_campaign(load_campaign(bench), paths=once)
    for name in ("regimes.csv", "identified.csv", "clearances.csv", "base.csv"):
        assert (session.results / name).read_bytes() == (once.folder / name).read_bytes(), name
    for record in table:
        for path, other in (
            (session.paths.record(record), once.record(record)),
            (session.paths.impacts(record), once.impacts(record)),
            (session.paths.estimates(record), once.estimates(record)),
        ):
            assert path.read_bytes() == other.read_bytes(), path
    _next_day(bench, session, monkey_analysis=analyse_nothing)


def analyse_nothing(*args: object, **more: object) -> None:
    raise AssertionError("a finished record was analysed again")


def _next_day(bench: Path, session: Session, *, monkey_analysis: object) -> None:
    """Starting again reads what is there, and analyses nothing."""
    session.stop()
    second = Session(bench, session.results, quiet=0.2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vinesexp.pipeline.analyse_record", monkey_analysis)
        patch.setattr(second, "_begin_background", lambda: None)  # processes as on the first day
        second.begin()
        second.settle()
    second.stop()
    assert {seen.view.verdict for seen in second.seen.values() if seen.view}
    assert set(second.seen) == set(session.seen)


@pytest.mark.long
def test_a_file_renamed_keeps_its_row_and_one_taken_away_is_said_at_once(
    bench, session, texts, monkeypatch
):
    monkeypatch.setattr(session, "_begin_background", lambda: None)  # nothing of all records
    raw = bench / "raw"
    (raw / "ring_1.csv").write_text(texts["ring_1.csv"])
    session.begin()
    session.settle()
    (raw / "ring_1.csv").rename(raw / "decay one.csv")
    session.settle()
    assert rows(bench)["ring_1"]["file"] == "raw/decay one.csv"
    assert session.seen["ring_1"].view.verdict in ("good", "look")
    shutil.copy(raw / "decay one.csv", raw / "again.csv")
    session.settle()
    assert "raw/again.csv" in session.status.remarks
    (raw / "again.csv").unlink()
    (raw / "decay one.csv").unlink()
    session.settle()
    assert "raw/again.csv" not in session.status.remarks
    assert session.seen["ring_1"].view.verdict == "cannot be used"


def test_a_row_more_is_read_and_looked_at_alone(bench, session, monkeypatch):
    """What a new record costs does not depend on how many there are."""
    sheet, looked_at = bench / "records.csv", []
    rows = [f"r{k},raw/r{k}.csv,ringdown,," for k in range(50)]
    sheet.write_text("\n".join(["record,file,test,clearance_mm,note", *rows]) + "\n")
    read = []
    monkeypatch.setattr(
        "vinesexp.records.campaign.records_csv.read_id", lambda text: (read.append(text), text)[1]
    )
    monkeypatch.setattr(session, "_due", lambda record: looked_at.append(record.id))
    session.begin()
    assert len(read) == len(looked_at) == 50
    del read[:], looked_at[:]
    sheet.write_text(sheet.read_text() + "new,raw/new.csv,ringdown,,\n")
    session._read_campaign()
    assert read == looked_at == ["new"]
    sheet.write_text(sheet.read_text().replace("raw/r7.csv,ringdown", "raw/r7.csv,drop"))
    session._read_campaign()
    assert read == looked_at == ["new", "r7"]
    description = bench / "campaign.yaml"  # another sensor: every row means something else
    description.write_text(description.read_text().replace("unit: m/s^2", "unit: g"))
    session._read_campaign()
    assert len(read) == len(looked_at) == 2 + 51


@pytest.fixture
def one_row(bench, session, texts):
    """A table as a person keeps it, with columns and words of their own."""
    (bench / "records.csv").write_text(
        'record,file,test,clearance_mm,x_mine,note\nring,raw/ring.csv,ringdown,,"a ""b""",mine\n'
    )
    session.begin()
    return session


def test_a_correction_changes_its_cell_and_nothing_else(bench, one_row):
    one_row.correct("ring", {"clearance_mm": "34"}, {"clearance_mm": ""})
    assert (bench / "records.csv").read_text() == (
        'record,file,test,clearance_mm,x_mine,note\nring,raw/ring.csv,ringdown,34,"a ""b""",mine\n'
    )
    one_row.correct("ring", {"exclude": "yes", "note": "cut"}, {"exclude": "", "note": "mine"})
    assert rows(bench)["ring"]["exclude"] == "yes"
    assert rows(bench)["ring"]["x_mine"] == 'a "b"'


def test_two_people_who_correct_one_row_do_not_undo_each_other(bench, one_row):
    one_row.correct("ring", {"clearance_mm": "34"}, {"clearance_mm": ""})
    with pytest.raises(ChangedMeanwhileError, match="is '34' by now; it was ''"):
        one_row.correct("ring", {"clearance_mm": "36"}, {"clearance_mm": ""})
    assert rows(bench)["ring"]["clearance_mm"] == "34"
    one_row.correct("ring", {"note": "other"}, {"note": "mine"})  # another cell: no conflict
    assert rows(bench)["ring"]["note"] == "other"


def test_a_table_edited_by_hand_meanwhile_is_what_counts(bench, one_row):
    text = (bench / "records.csv").read_text()
    (bench / "records.csv").write_text(text.replace(",mine", ",by hand"))
    with pytest.raises(ChangedMeanwhileError):
        one_row.correct("ring", {"note": "x"}, {"note": "mine"})
    one_row.correct("ring", {"clearance_mm": "34"}, {"clearance_mm": ""})
    assert rows(bench)["ring"]["note"] == "by hand"
    (bench / "records.csv").write_text(text.replace("ring,raw", "other,raw"))
    with pytest.raises(CampaignError, match="holds no record 'ring' any more"):
        one_row.correct("ring", {"clearance_mm": "36"}, {"clearance_mm": "34"})


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ({"clearance_mm": "wide"}, "found 'wide', expected a number"),
        ({"test": "periodc"}, "unknown test 'periodc'"),
        ({"record": "x"}, "'record' cannot be changed here"),
        ({"file": "../../x"}, "'file' cannot be changed here"),
    ],
)
def test_a_wrong_correction_is_refused_and_leaves_the_table(bench, one_row, cells, message):
    before = (bench / "records.csv").read_bytes()
    seen = {"clearance_mm": "", "test": "ringdown", "record": "ring", "file": "raw/ring.csv"}
    with pytest.raises(CampaignError, match=message):
        one_row.correct("ring", cells, {name: seen[name] for name in cells})
    assert (bench / "records.csv").read_bytes() == before


def test_a_mistake_made_by_hand_is_on_the_page_until_it_is_put_right(bench, one_row):
    text = (bench / "records.csv").read_text()
    (bench / "records.csv").write_text(text.replace("ringdown", "ringdwn"))
    one_row.step()
    assert "unknown test" in parts_of(one_row)["status"]
    (bench / "records.csv").write_text(text)
    one_row.step()
    assert "unknown test" not in parts_of(one_row)["status"]
