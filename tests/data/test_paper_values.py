"""Published values: every row has its source, and the numbers agree with one another."""

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest

from vinesexp.laboratory.scene import load_scene
from vinesexp.rig import NES, Oscillator, Rig
from vinesexp.units import parse_quantity

PAPER = Path(__file__).parents[2] / "data" / "paper"
FILES = sorted(path.name for path in PAPER.glob("*.csv"))


def rows_of(name):
    with (PAPER / name).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def table_2():
    kinds = {"kg": "mass", "g": "mass", "N s/m": "damping", "N/m": "stiffness", "Hz": "frequency"}
    return {
        row["parameter"]: parse_quantity(
            f"{row['value']} {row['unit']}", kinds.get(row["unit"], "ratio")
        ).value
        for row in rows_of("table_2.csv")
    }


def test_the_files_are_those_that_the_readme_tells():
    reported = re.findall(r"^\| `(\w+\.csv)`", (PAPER / "README.md").read_text(), re.MULTILINE)
    assert sorted(reported) == FILES


@pytest.mark.parametrize("name", FILES)
def test_every_row_says_where_it_is_from(name):
    rows = rows_of(name)
    assert rows
    for row in rows:
        assert None not in row, f"too many cells: {row}"
        assert None not in row.values(), f"too few cells: {row}"
        if name == "equations.csv":
            assert re.match(r"\(\d+\)", row["equation"])
        else:
            assert re.match(r"(Table|Figures?|Section|Equation) \(?\d", row["source"])


def test_table_2_agrees_with_its_own_reduced_parameters():
    t = table_2()
    rig = Rig(Oscillator(M=t["M"], c1=t["c1"], k1=t["k1"]), [NES(m=t["m"], b=0.034, r=t["r"])])
    # half a unit of the last printed digit
    assert rig.eps == pytest.approx(t["eps"], abs=0.5e-4)
    assert rig.lam == pytest.approx(t["lambda"], abs=0.005)
    assert rig.oscillator.f0 == pytest.approx(t["f0"], abs=0.005)


def test_the_twin_is_the_rig_of_table_2():
    t = table_2()
    scene = load_scene(PAPER.parent / "twin" / "scene.yaml")
    assert scene.oscillator == Oscillator(M=t["M"], c1=t["c1"], k1=t["k1"])
    (ball,) = scene.balls
    assert (ball.m, ball.r) == (pytest.approx(t["m"], rel=1e-15), t["r"])


def test_table_1_is_folds_times_clearance_but_for_the_misprint():
    from vinesexp.theory.manifold import A_1

    fold = float(A_1(table_2()["r"]))
    for row in rows_of("table_1.csv"):
        exact = fold * float(row["clearance_mm"])
        # the first two are cut, not rounded: 3.14 and 7.86
        agrees = abs(exact - float(row["x1_mm"])) < 0.1
        assert agrees is ("misprinted" not in row["note"])


def test_decay_times_are_those_of_table_1():
    times = {
        (float(row["clearance_mm"]), float(row["level_mm"])): float(row["time_s"])
        for row in rows_of("decay_times.csv")
    }
    for row in rows_of("table_1.csv"):
        b = float(row["clearance_mm"])
        assert times.pop((b, 15.0)) == float(row["time_to_15_mm_s"])
        assert times.pop((b, 5.0)) == float(row["time_to_5_mm_s"])
    assert not times


def test_predicted_clearances_are_what_the_published_formulas_give():
    from vinesexp.theory.optimal_clearance import b_c_published

    t = table_2()
    rig = Rig(Oscillator(M=t["M"], c1=t["c1"], k1=t["k1"]), [NES(m=t["m"], b=0.034, r=t["r"])])
    reduced = {"eps": rig.eps, "lam": rig.lam, "r": t["r"]}
    seen = 0
    for row in rows_of("best_clearances.csv"):
        level, b = float(row["level_mm"]), float(row["clearance_mm"])
        if row["kind"] != "predicted":
            assert row["kind"] == "measured"
            continue
        seen += 1
        if row["test"] == "periodic":
            assert float(b_c_published(G=level, **reduced)) == pytest.approx(b, abs=0.5)
        else:
            assert level / 0.6 == pytest.approx(b, abs=0.5)
    assert seen == 3


def test_notes_state_the_exact_values_that_theory_gives():
    from vinesexp.theory.manifold import A_2

    exact = float(A_2(table_2()["r"]))
    gamma = (1.0 - 0.6) / (1.0 + 0.6)
    closed = 2.0 * math.sqrt(4.0 + math.pi**2 * gamma**2) / (math.pi**2 - 4.0)
    assert exact == pytest.approx(closed, rel=1e-14)
    notes = " ".join(row.get("note", "") for name in FILES for row in rows_of(name))
    for text in (f"{exact:.4f}", f"{20 / exact:.1f} mm", f"{30 / exact:.2f} mm"):
        assert text in notes


def test_every_claim_has_a_verdict_on_the_page():
    page = (PAPER.parents[1] / "docs" / "paper.md").read_text(encoding="utf-8")
    rows = rows_of("claims.csv")
    assert len({row["claim"] for row in rows}) == len(rows) > 50
    for row in rows:
        start = f"| {row['source']} | {row['text']} | **"
        verdict = page.partition(start)[2].partition("** | ")[0]
        assert verdict in ("agrees", "in part", "differs", "cannot be judged"), row["claim"]


def test_a_straight_part_of_a_decay_is_told_from_an_exponential():
    from benchmarks.paper.straight_parts import parts_of

    t = np.arange(0.0, 8.0, 0.05)
    fall = np.where(t < 2.0, 20.0 - 8.0 * t, 4.0 * np.exp(-0.33 * (t - 2.0)))
    straight, curved = parts_of(t, fall, [19.0, 4.05, 0.6])
    assert straight.straight
    assert not curved.straight
    assert curved.rate == pytest.approx(0.33, rel=0.02)


def test_the_twin_is_compared_with_values_that_its_records_can_judge():
    from vinesexp.records.campaign.load import load_campaign

    twin = load_campaign(PAPER.parent / "twin")
    assert len(twin.published) > 15
    clearances = {tuple(1e3 * b for b in record.clearance) for record in twin.records}
    for value in twin.published:
        for tried in [*value.tried_mm.split("|"), value.clearance_mm]:
            if tried:
                assert tuple(float(b) for b in tried.split(";")) in clearances
