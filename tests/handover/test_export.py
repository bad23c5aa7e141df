"""What is handed on holds the numbers of the results, and says what it is."""

import csv
import hashlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from vinesexp.cli import main
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.schema import Channel, Setup
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.stored.result_columns import IDENTIFIED, IMPACTS, RECORD_REGIMES
from vinesexp.records.stored.store import RecordWriter, write_refused
from vinesexp.records.stored.tables import write_rows

TWIN = Path(__file__).parents[2] / "data/twin"
ADA = "https://orcid.org/0000-0002-1825-0097"
RATE, N = 1000.0, 70_000
X = 1e-3 * np.sin(np.arange(N) / 7.0)
A = 40.0 * np.cos(np.arange(N) / 7.0)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    folder = tmp_path / "results/spring"
    row = {"parameter": "M", "value": 4.7, "std_error": 0.1, "unit": "kg", "method": "combined"}
    write_rows(folder / "identified.csv", IDENTIFIED, [row])
    hits = [
        {**dict.fromkeys(IMPACTS.names), "time_s": 0.5 + k, "nes": 1, "side": (-1) ** k,
         "velocity_jump_m_s": 0.01 * k, "unseen_before": 0, "crowded": 0, "clipped": 0}
        for k in range(3)
    ]  # fmt: skip
    write_rows(folder / "impacts/b34.csv", IMPACTS, hits)
    for kind in ("records", "conditioned"):
        with RecordWriter(
            folder / kind / "b34.nc", sample_rate=RATE, start=0.25,
            quantities={"displacement": "displacement", "acceleration": "acceleration"},
            attributes={"source": "raw/a.csv", "source_sha256": "ab" * 32},
        ) as writer:  # fmt: skip
            scale = 1.0 if kind == "records" else 0.5
            writer.append({"displacement": scale * X, "acceleration": scale * A})
    write_refused(folder / "records/lost.nc", "raw/lost.csv: is empty")
    regimes = [{**dict.fromkeys(RECORD_REGIMES.names), "record": id} for id in ("b34", "lost")]
    write_rows(folder / "regimes.csv", RECORD_REGIMES, regimes)
    return folder


def test_what_is_handed_on_is_what_the_table_names(results, tmp_path):
    """A record that left the campaign may have left its file."""
    shutil.copyfile(results / "records/b34.nc", results / "records/gone.nc")
    assert main(["export", str(results), str(tmp_path / "out")]) == 0
    assert not list((tmp_path / "out").glob("gone*"))


@pytest.mark.parametrize("keep", [0, 3000, 200_000])
def test_a_damaged_record_is_left_out_and_named(keep, results, tmp_path, capsys):
    path = results / "records/b34.nc"
    path.write_bytes(path.read_bytes()[:keep])
    assert main(["export", str(results), str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "b34: left out" in shown
    assert "run again" in shown
    assert not list((tmp_path / "out").glob("b34*"))


def test_a_damaged_record_takes_no_file_of_another_along(results, tmp_path):
    """`b34` and `b34.2` share the beginning of their files' names."""
    regimes = [{**dict.fromkeys(RECORD_REGIMES.names), "record": id} for id in ("b34.2", "b34")]
    write_rows(results / "regimes.csv", RECORD_REGIMES, regimes)
    for file in ("records/b34.nc", "impacts/b34.csv"):
        source = results / file
        shutil.copyfile(source, source.with_stem("b34.2"))
    damaged = results / "records/b34.nc"
    damaged.write_bytes(damaged.read_bytes()[:200_000])
    assert main(["export", str(results), str(tmp_path / "out")]) == 0
    left = {path.name for path in (tmp_path / "out").iterdir() if path.name.startswith("b34")}
    assert left == {"b34.2.csv", "b34.2.impacts.csv"}


def test_matlab_gets_channels_units_and_impacts(results, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["export", str(results), str(out), "--format", "mat"]) == 0
    assert "lost: left out: raw/lost.csv: is empty" in capsys.readouterr().out
    found = scipy.io.loadmat(out / "b34.mat", squeeze_me=True, struct_as_record=False)
    np.testing.assert_allclose(found["displacement"], X, rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(found["time"][:2], [0.25, 0.251])
    assert found["units"].acceleration == "m/s^2"
    assert list(found["impacts"].side) == [1, -1, 1]
    assert np.isnan(found["impacts"].x_m).all()
    assert (out / "identified.csv").read_text() == (results / "identified.csv").read_text()


def test_text_gets_every_sample_and_conditioned_ones_on_request(results, tmp_path):
    for flag, scale in (([], 1.0), (["--conditioned"], 0.5)):
        out = tmp_path / f"out{scale}"
        assert main(["export", str(results), str(out), "--record", "b34", *flag]) == 0
        with (out / "b34.csv").open(encoding="utf-8") as stream:
            assert next(csv.reader(stream)) == ["time_s", "displacement_m", "acceleration_m_s2"]
        table = np.loadtxt(out / "b34.csv", delimiter=",", skiprows=1)
        assert table.shape == (N, 3)
        np.testing.assert_allclose(table[:, 2], scale * A, rtol=1e-6, atol=1e-5)
        assert len((out / "b34.impacts.csv").read_text().splitlines()) == 4


def test_universal_files_come_back_through_the_reader(results, tmp_path):
    pytest.importorskip("pyuff")
    out = tmp_path / "out"
    assert main(["export", str(results), str(out), "--format", "uff"]) == 0
    channel = Channel("acceleration", 1, "acceleration", 1.0, unit="m/s^2", sensitivity=False)
    rate, start, values = read_channels(out / "b34.uff", Setup({"acceleration": channel}))
    assert (rate, start) == (pytest.approx(RATE), pytest.approx(0.25))
    np.testing.assert_allclose(values["acceleration"], A, rtol=1e-6, atol=1e-5)


def test_the_metadata_names_every_file_its_digest_and_its_source(results, tmp_path):
    out = tmp_path / "out"
    assert main(["export", str(results), str(out)]) == 0
    crate = json.loads((out / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    assert crate["@context"] == "https://w3id.org/ro/crate/1.1/context"
    things = {thing["@id"]: thing for thing in crate["@graph"]}
    parts = {part["@id"] for part in things["./"]["hasPart"]}
    assert parts == {p.name for p in out.iterdir()} - {"ro-crate-metadata.json"}
    digest = hashlib.sha256((out / "b34.csv").read_bytes()).hexdigest()
    assert things["b34.csv"]["identifier"] == f"sha256:{digest}"
    (source,) = things["b34.csv"]["isBasedOn"]
    assert things[source["@id"]]["name"] == "raw/a.csv"
    references = json.dumps(crate["@graph"])
    for name in things:
        assert f'"{name}"' in references


def described(tmp_path: Path, results: Path, license: str) -> None:
    """A campaign, with authors and a licence, that results are of."""
    folder = tmp_path / "campaign"
    shutil.copytree(TWIN, folder, ignore=shutil.ignore_patterns("truth", "raw"))
    people = f"author: Ada Example ({ADA}); Bo Example\nlicense: {license}\n"
    text = (folder / "campaign.yaml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if not line.startswith(("author:", "license:"))]
    (folder / "campaign.yaml").write_text("\n".join([*kept, people]), encoding="utf-8")
    (results / ".campaign").write_text(f"{folder}\n")


def test_author_licence_and_title_are_those_of_the_campaign(results, tmp_path):
    out = tmp_path / "out"
    described(tmp_path, results, "CC-BY-4.0")
    assert main(["export", str(results), str(out)]) == 0
    crate = json.loads((out / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    things = {thing["@id"]: thing for thing in crate["@graph"]}
    whole = things["./"]
    assert whole["name"] == load_campaign(TWIN).title
    assert whole["license"] == {"@id": "https://spdx.org/licenses/CC-BY-4.0"}
    assert things[whole["license"]["@id"]]["name"] == "CC-BY-4.0"
    assert [things[one["@id"]]["name"] for one in whole["author"]] == ["Ada Example", "Bo Example"]
    assert whole["author"][0] == {"@id": ADA}


def test_a_licence_that_is_none_is_refused(results, tmp_path, capsys):
    described(tmp_path, results, "mine alone")
    assert main(["export", str(results), str(tmp_path / "out")]) == 1
    assert "expected an SPDX identifier" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--record", "b33"], "did you mean 'b34'"),
        ([], "holds files already"),
    ],
)
def test_a_mistake_is_one_line(results, tmp_path, capsys, words, message):
    out = tmp_path / "full"
    out.mkdir()
    (out / "mine.txt").write_text("keep")
    assert main(["export", str(results), str(out), *words]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_figures_need_the_campaign_and_a_width_that_a_page_has(results, tmp_path, capsys):
    words = ["export", str(results), str(tmp_path / "out"), "--figures"]
    assert main([*words, "90"]) != 0
    assert "its description is needed to draw figures" in capsys.readouterr().err
    assert main([*words, "9"]) != 0
    assert "expected a width from 60 to 250 mm" in capsys.readouterr().err
