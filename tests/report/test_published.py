"""Published values beside a campaign's own: the interval decides."""

from pathlib import Path

import pytest

from vinesexp.records.campaign.published_table import PublishedValue
from vinesexp.records.campaign.schema import Campaign, Known, Record
from vinesexp.report.published_beside import published_rows
from vinesexp.results import CampaignResults
from vinesexp.units import Quantity

RECORDS = (
    Record("b25", Path("a"), "periodic", (0.025,), base_amplitude=0.25e-3),
    Record("b34", Path("a"), "periodic", (0.034,), base_amplitude=0.25e-3),
    Record("swept", Path("a"), "sweep", (0.023, 0.034), base_amplitude=0.25e-3),
    Record("fall", Path("a"), "transient", (0.033, 0.010), release=0.020),
    Record("fall_1", Path("a"), "transient", (0.033,), release=0.020),
)
TABLES = {
    "identified": [
        {"parameter": name, "method": "combined", "value": v,
         "unit": "kg" if name == "M" else "1",
         "ci95_low": low, "ci95_high": high}
        for name, v, low, high in (
            ("M", 4.72, 4.66, 4.78), ("zeta", 0.0065, None, None), ("r", 0.62, 0.61, 0.63)
        )
    ],
    "regimes": [
        {"record": "b25", "amplitude_mean_m": 0.008, "amplitude_max_m": 0.008},
        {"record": "b34", "amplitude_mean_m": 0.005, "amplitude_max_m": 0.005},
        {"record": "swept", "amplitude_mean_m": 0.003, "amplitude_max_m": 0.0083,
         "amplitude_running_max_m": 0.0067},
    ],
    "clearances": [
        {"test": "periodic", "level": "G = 0.25 mm", "stated_base_mm": 0.25,
         "kind": "lowest amplitude",
         "measured_mm": 33, "measured_low_mm": 32, "measured_high_mm": 34,
         "published_mm": 33.97, "exact_mm": 33.92},
        {"test": "transient", "level": "20 mm to 5 mm", "release_mm": 20.0, "target_mm": 5.0,
         "kind": "fastest decay",
         "measured_mm": 42, "measured_low_mm": 36, "measured_high_mm": None,
         "published_mm": 33.33, "exact_mm": 27.3},
    ],
    "decay_times": [
        {"record": "fall", "target_m": 0.01, "time_s": 1.2},
        {"record": "fall_1", "target_m": 0.01, "time_s": 1.3},
    ],
    "transitions": [{"record": "fall", "transition_m": 0.0041}],
}  # fmt: skip


def verdict(*fields: object, tables: object = TABLES, **more: object) -> dict[str, str]:
    value = PublishedValue(*fields, source="Table 2", **more)  # type: ignore[arg-type]
    campaign = Campaign(
        folder=Path(), name="a", title="a", known=Known(nes_mass=(Quantity(0.032, 0.0),)),
        channels={}, time=None, sample_rate=None, bandpass=None, records=RECORDS,
        published=(value,),
    )  # fmt: skip
    results = CampaignResults(Path(), campaign)
    results._rows.update(tables)  # type: ignore[call-overload]
    (row,) = published_rows(results)
    return row


@pytest.mark.parametrize(
    ("value", "more", "expected"),
    [
        (("M", "4.7"), {}, "agrees"),
        (("r", "0.6"), {}, "agrees"),  # one digit: 0.55 to 0.65
        (("r", "0.60"), {}, "differs by +3.3 %"),
        (("eps", "0.0068"), {}, "agrees"),
        (("lambda", "1.92"), {}, "agrees"),  # 2 0.0065 4.72/0.032 = 1.918
        (("lambda", "1.91"), {}, "differs by +0.4 %"),
        (("zeta", "0.007"), {}, "agrees"),  # no interval: half a digit off, to the last bit
        (("k1", "1.147e4"), {}, "not measured"),
        (("best clearance", "34"), {"base_amplitude_mm": 0.25}, "agrees"),
        (("best clearance", "23"), {"base_amplitude_mm": 0.15}, "not measured"),
        (("best of tried", "34"), {"base_amplitude_mm": 0.25, "tried_mm": "25|34"}, "agrees"),
        (("best of tried", "25"), {"base_amplitude_mm": 0.25, "tried_mm": "25|34"}, "differs"),
        (("b_c", "34"), {"base_amplitude_mm": 0.25}, "agrees"),
        (("b_t", "33"), {"release_mm": 20.0}, "agrees"),
        (("fastest clearance", "33"), {"release_mm": 20.0}, "differs by +27.3 %"),
        (
            ("largest amplitude", "4.9", "mm"),
            {"clearance_mm": "34;23", "base_amplitude_mm": 0.25},
            "differs by +37 % to +69 %",
        ),
        (
            ("largest amplitude", "7.9", "mm"),
            {"clearance_mm": "23;34", "base_amplitude_mm": 0.25},
            "in part: between the two",
        ),
        (
            ("largest amplitude", "8.3", "mm"),
            {"clearance_mm": "23;34", "base_amplitude_mm": 0.25},
            "agrees",
        ),
        (
            ("time to level", "1.2"),
            {"clearance_mm": "33;10", "release_mm": 20.0, "level_mm": 10.0},
            "agrees",
        ),
        (
            ("fastest of tried", "33;10"),
            {"release_mm": 20.0, "level_mm": 10.0, "tried_mm": "33|33;10"},
            "agrees",
        ),
        (
            ("transition amplitude", "4.1"),
            {"clearance_mm": "33;10", "release_mm": 20.0},
            "agrees",
        ),
    ],
)
def test_a_value_agrees_where_its_digits_meet_the_interval(
    value: tuple[str, ...], more: dict[str, object], expected: str
) -> None:
    assert verdict(*value, **more)["verdict"] == expected


def test_a_value_outside_the_interval_that_was_found_does_not_agree() -> None:
    """34 mm beside 32.88 (31.94 to 33.56): half a printed digit does not reach it."""
    bracket = {"measured_mm": 32.88, "measured_low_mm": 31.94, "measured_high_mm": 33.56}
    tables = {**TABLES, "clearances": [{**TABLES["clearances"][0], **bracket}]}
    for printed, expected in (("34", "differs by -3.3 %"), ("33", "agrees")):
        row = verdict("best clearance", printed, "mm", base_amplitude_mm=0.25, tables=tables)
        assert row["own"] == "32.88 (31.94 to 33.56) mm"
        assert row["verdict"] == expected


def test_a_difference_is_not_said_to_be_nothing() -> None:
    """4.7210 is outside what 4.72 without an interval reaches, by 0.02 %."""
    exact = {**TABLES["identified"][0], "ci95_low": 4.72, "ci95_high": 4.72}
    row = verdict("M", "4.7210", "kg", tables={**TABLES, "identified": [exact]})
    assert row["verdict"] == "differs by less than 0.1 %"


def test_a_row_says_what_it_is_of_and_what_was_found() -> None:
    row = verdict("largest amplitude", "4.9", "mm", "23;34", base_amplitude_mm=0.25)
    assert row["what"] == "largest amplitude, b = 23 + 34 mm, G = 0.25 mm"
    assert row["own"] == "8.30 mm; 6.70 as a mean over 0.1 Hz"
    assert row["kind"] == "differs"
    tried = verdict("best of tried", "34", "mm", base_amplitude_mm=0.25, tried_mm="25|34")
    assert tried["own"] == "34 mm (25: 8 mm, 34: 5 mm)"
    assert verdict("M", "4.7", "kg")["own"] == "4.72 (4.66 to 4.78) kg"
    assert verdict("r", "0.6")["own"] == "0.62 (0.61 to 0.63)"
    assert tried["what"] == "best of 25, 34 mm, G = 0.25 mm"


def test_a_clearance_that_is_fastest_to_some_levels_agrees_in_part() -> None:
    """42 (36 and up) to 5 mm, 33 (30 to 36) to 3 mm: 33 is right for one of the two."""
    more = {
        **TABLES["clearances"][1],
        "level": "20 mm to 3 mm",
        "target_mm": 3.0,
        "measured_mm": 33,
    }
    more |= {"measured_low_mm": 30, "measured_high_mm": 36}
    tables = {**TABLES, "clearances": [*TABLES["clearances"], more]}
    row = verdict("fastest clearance", "33", release_mm=20.0, tables=tables)
    assert row["verdict"] == "in part: to 3 mm"
    assert row["kind"] == "in part"


def test_a_clearance_between_two_brackets_agrees_with_neither() -> None:
    """42 (36 to 48) to 5 mm and 30 (24 to 33) to 3 mm: 34.5 is in none of them."""
    row = TABLES["clearances"][1]
    five = {**row, "measured_mm": 42, "measured_low_mm": 36, "measured_high_mm": 48}
    three = {**row, "target_mm": 3.0, "measured_mm": 30, "measured_low_mm": 24}
    tables = {**TABLES, "clearances": [five, {**three, "measured_high_mm": 33}]}
    found = verdict("fastest clearance", "34.5", release_mm=20.0, tables=tables)
    assert found["verdict"] == "differs by +21.7 %"


def test_a_record_of_another_clearance_than_stated_tests_no_published_value() -> None:
    """Of 34 mm by the test log and 31 mm by the records: it is not what the authors tried."""
    off = {"item": "clearance", "record": "b34", "found": 31.0, "verdict": "off"}
    wanted = {"base_amplitude_mm": 0.25, "tried_mm": "25|34"}
    assert verdict("best of tried", "34", **wanted)["verdict"] == "agrees"
    row = verdict("best of tried", "34", **wanted, tables={**TABLES, "inputs": [off]})
    assert row["verdict"] == "not measured"
