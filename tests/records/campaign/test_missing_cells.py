"""Empty cells that an answer needs: said with the column, the records and the answer."""

from pathlib import Path

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.missing_cells import Evidence, missing_cells
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.report.verdict import headline
from vinesexp.units import Quantity


def campaign_of(*records: Record, nes_mass: bool = True) -> Campaign:
    known = Known(nes_mass=(Quantity(0.032),) if nes_mass else ())
    return Campaign(Path("c"), "c", "c", known, {}, None, None, None, tuple(records))


def row(id: str, test: str, **cells) -> Record:
    return Record(id, Path(f"{id}.csv"), test, **cells)


def found(campaign: Campaign, **evidence: Evidence) -> dict[str, str]:
    checks = missing_cells(campaign, evidence)
    assert all(check.outcome == "warning" for check in checks)
    return {check.detail.split()[0]: check.detail for check in checks}


def test_a_row_that_is_filled_in_lacks_nothing():
    full = row("a", "periodic", clearance=(0.03,), base_amplitude=2.5e-4)
    bare = row("b", "periodic")  # without NES, and no impact contradicts it
    decay = row("d", "ringdown")
    campaign = campaign_of(full, bare, decay)
    assert found(campaign, a=Evidence(), b=Evidence(impacts=3), d=Evidence(frequency=7.8)) == {}


def test_impacts_in_a_row_without_clearance_ask_for_it_and_for_the_base():
    campaign = campaign_of(row("a", "periodic"), row("b", "periodic"))
    said = found(campaign, a=Evidence(160), b=Evidence(166, base=5e-4))
    assert set(said) == {"clearance_mm", "base_amplitude_mm"}
    assert "in a, b, although 326 impacts were found there" in said["clearance_mm"]
    assert "is empty in a; the test belongs to no level" in said["base_amplitude_mm"]


@pytest.mark.parametrize("test", ["periodic", "transient"])
def test_a_length_that_the_record_shows_is_not_lacking(test):
    """b_c was said to stay unknown, and was given by the amplitude of the base channel."""
    shown = Evidence(base=2.5e-4) if test == "periodic" else Evidence(release=0.0123)
    column = "base_amplitude_mm" if test == "periodic" else "release_mm"
    assert found(campaign_of(row("a", test, clearance=(0.03,))), a=shown) == {}
    asked = row("a", test, clearance=(0.03,), note=f"FILL IN: {column}")
    said = found(campaign_of(asked), a=shown)[column]
    length = "base channel shows 0.25" if test == "periodic" else "displacement shows 12.3"
    assert f"(the {length} mm); the analysis uses that" in said


def test_a_note_that_still_says_fill_in_is_heeded_until_it_is_taken_out():
    note = "it decays; FILL IN, if it applies: clearance_mm release_mm"
    open_row, decided = row("a", "transient", note=note), row("a", "transient", note="it decays")
    said = found(campaign_of(open_row), a=Evidence())
    assert set(said) == {"clearance_mm", "release_mm"}
    assert all("remove FILL IN from the note" in one for one in said.values())
    assert found(campaign_of(decided), a=Evidence()) == {}


def test_ring_downs_of_other_frequencies_are_of_other_masses():
    rows = [row("a", "ringdown"), row("b", "ringdown"), row("c", "ringdown", added_mass=0.4)]
    shown = {"a": Evidence(frequency=7.86), "b": Evidence(frequency=7.55)}
    shown["c"] = Evidence(frequency=7.55)
    said = found(campaign_of(*rows), **shown)["added_mass_g"]
    assert "is empty in b as in a, but they oscillate at 7.55 and 7.86 Hz" in said
    assert "on different rigs, or with a spring that is far from straight; f0, zeta" in said
    assert found(campaign_of(rows[0], rows[2]), **shown) == {}


def test_a_ring_down_without_added_mass_is_plain_once_another_one_has_it():
    note = "it decays; FILL IN, if it applies: added_mass_g"
    rows = [row("a", "ringdown", note=note), row("b", "ringdown", added_mass=0.4)]
    shown = {"a": Evidence(frequency=7.86), "b": Evidence(frequency=7.55)}
    assert found(campaign_of(*rows), **shown) == {}
    assert set(found(campaign_of(rows[0]), **shown)) == {"added_mass_g"}


def test_a_ball_without_a_mass_is_reported_and_records_left_out_are_not():
    test = row("a", "periodic", clearance=(0.03,), base_amplitude=2.5e-4)
    assert set(found(campaign_of(test, nes_mass=False), a=Evidence())) == {"known.nes_mass"}
    left_out = row("b", "periodic", exclude=True)
    assert found(campaign_of(left_out, row("c", "periodic")), b=Evidence(99)) == {}


def test_the_report_names_the_cell_in_the_place_of_a_best_clearance():
    check = {"record": "", "check": "missing", "outcome": "warning", "detail": "clearance_mm is"}
    assert "No best clearance can be reported: clearance_mm is" in headline([], [], {}, [check])
    other = check | {"check": "units"}
    assert "clearance_mm" not in headline([], [], {}, [other])


@pytest.fixture
def two_tests(tmp_path):
    """A steady test with 40 contacts in its acceleration, and one without any."""
    rng = np.random.default_rng(0)
    t = np.arange(10000) / 2000.0
    for name, hits in (("with", True), ("without", False)):
        x = 5e-3 * np.sin(50.0 * t) + 1e-6 * rng.standard_normal(t.size)
        a = -12.5 * np.sin(50.0 * t) + 0.05 * rng.standard_normal(t.size)
        for k in range(1, 40 if hits else 0):
            s = k * np.pi / 25.0
            a += np.where(abs(t - s) < 2e-3, 60.0 * np.cos(np.pi * (t - s) / 4e-3), 0.0)
        rows = "\n".join(f"{p:.4f},{q * 1e3:.5f},{r:.4f}" for p, q, r in zip(t, x, a, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"Time (s),Laser (mm),Acc (m/s^2)\n{rows}\n")
    (tmp_path / "campaign.yaml").write_text(
        "known: {nes_mass: 32 g}\ntime: {column: 'Time*', unit: s}\nchannels:\n"
        "  displacement: {column: 'Laser*', quantity: displacement, unit: mm}\n"
        "  acceleration: {column: 'Acc*', quantity: acceleration, unit: m/s^2}\n"
    )
    (tmp_path / "records.csv").write_text(
        "record,file,test\nwith,with.csv,periodic\nwithout,without.csv,periodic\n"
    )
    return tmp_path


@pytest.mark.long
def test_check_counts_the_impacts_of_a_row_without_clearance(two_tests, capsys):
    assert main(["check", str(two_tests)]) == 0
    lines = capsys.readouterr().out.splitlines()
    (said,) = [line for line in lines if "clearance_mm" in line]
    assert said.startswith("with: missing: clearance_mm is empty in with, although 39 impacts")
    assert lines[-2].endswith("0 refused, 0 excluded; 2 warnings")
    assert lines[-1].startswith("next: fill in what is missing")
    assert lines[-1].endswith(f"vinesexp run {two_tests}")
