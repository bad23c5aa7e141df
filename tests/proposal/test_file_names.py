"""Lengths and masses in the names of files: what labs write, and what is no reading."""

import pytest

from vinesexp.proposal.file_names import read_name

PERIODIC = {
    "37p1mm": {"clearance_mm": "37.1"},
    "24p5mm_take2": {"clearance_mm": "24.5"},
    "b37_G0.25": {"clearance_mm": "37", "base_amplitude_mm": "0.25"},
    "G=0,25mm": {"base_amplitude_mm": "0.25"},
    "steady_34mm_1": {"clearance_mm": "34"},
    "b0.034m G250um": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "run_G0.25mm_b34.5mm": {"clearance_mm": "34.5", "base_amplitude_mm": "0.25"},
    "b23_b34": {"clearance_mm": "23;34"},
    "b23+34mm_G0.3": {"clearance_mm": "23;34", "base_amplitude_mm": "0.3"},
    "34mm_0.25mm": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "0p25mm": {"base_amplitude_mm": "0.25"},
    "gap 3.4 cm": {"clearance_mm": "34"},
    "Clearance-32,5mm_exc0.3mm": {"clearance_mm": "32.5", "base_amplitude_mm": "0.3"},
    "b34_20250312": {"clearance_mm": "34"},
    "b34G0.25": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "34.5mmG0.25mm": {"clearance_mm": "34.5", "base_amplitude_mm": "0.25"},
    "T01_b=34mm_g=0.25mm_f=7.86Hz": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "M32g-B34mm-A250um-R1": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "test 12 - 34.5 mm - 0.3 mm": {"clearance_mm": "34.5", "base_amplitude_mm": "0.3"},
    "essai_jeu 34,5 mm excitation 250 um": {"clearance_mm": "34.5", "base_amplitude_mm": "0.25"},
    "b1=34_b2=23": {"clearance_mm": "34;23"},
    "34mm+23mm_G0.3": {"clearance_mm": "34;23", "base_amplitude_mm": "0.3"},
    "34mm,0.25mm": {"clearance_mm": "34", "base_amplitude_mm": "0.25"},
    "b34±0.1mm": {"clearance_mm": "34"},
    "gap=34mm+-0.1": {"clearance_mm": "34"},
    "b34_ball25mm": {"clearance_mm": "34"},
    "run_b34_A0.25V_exc2": {"clearance_mm": "34"},
    # What may be something else: hundredths, peak to peak, rms, twice the clearance, ranges.
    "PER_b34_G025": {"clearance_mm": "34"},
    "G0.5mm_pp_b34": {"clearance_mm": "34"},
    "34mm_0.18mm rms": {"clearance_mm": "34"},
    "2b=68mm": {},
    "clearance_68mm_total": {},
    "L68mm_G0.25": {"base_amplitude_mm": "0.25"},
    "b30-40mm_G0.25": {"base_amplitude_mm": "0.25"},
    "G0.25-0.40_b34": {"clearance_mm": "34"},
    "b34to36_G0.25mm_G0.30mm": {},
    "b1_34mm": {},
    "b=23/34": {},
    "b23mm,34mm": {},
    # No reading: a counter, a date, a rate, a number that may be either, a zero.
    "scope_0034": {},
    "2025-03-12_11-20-05": {},
    "10kHz_5V": {},
    "3mm": {},
    "30mm_20mm": {},
    "G0": {},
    "34-3": {},
    "B2B_7p8Hz": {},
    "tb34x": {},
}


@pytest.mark.parametrize("name", PERIODIC)
def test_the_names_of_periodic_tests(name):
    assert {r.column: r.cell for r in read_name(name, "periodic")} == PERIODIC[name]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("ring_x0=20mm", {"release_mm": "20"}),
        ("ring_20mm_+400g", {"release_mm": "20", "added_mass_g": "400"}),
        ("decay added 0,4kg", {"added_mass_g": "400"}),
        ("m0.4kg", {}),
        ("M=5.1kg_x0 20", {"release_mm": "20"}),
        ("mass_5.1kg_total", {}),
        ("mass2_ring", {}),
        ("200g_100g", {}),
        ("ring_b34", {}),
    ],
)
def test_the_names_of_ring_downs(name, expected):
    assert {r.column: r.cell for r in read_name(name, "ringdown")} == expected


def test_a_release_is_told_from_a_clearance_by_the_record():
    def cells(name, release):
        return {r.column: r.cell for r in read_name(name, "transient", release=release)}

    assert cells("24mm_20mm", 19.6) == {"clearance_mm": "24", "release_mm": "20"}
    assert cells("rel20_b24", None) == {"clearance_mm": "24", "release_mm": "20"}
    assert cells("24mm", 20.3) == {"clearance_mm": "24"}
    assert cells("20mm", 20.3) == {"release_mm": "20"}
    assert cells("24mm", None) == {}
    assert cells("release_24mm", 20.3) == {"clearance_mm": "24"}
    assert cells("20mm_21mm", 20.3) == {}


def test_a_reading_holds_the_part_of_the_name():
    (one,) = read_name("steady_G=0,25mm_x", "periodic")
    assert one.said == "G=0,25mm"
