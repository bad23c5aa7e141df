"""`vinesexp design`: contract of the options and of --json, the table, what it asks for."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path

import pytest

from vinesexp import NES, Oscillator, Rig
from vinesexp.cli import main
from vinesexp.commands.options import draw
from vinesexp.figures.style import new_figure

RIG = {
    "--mass": "4.7 kg",
    "--damping": "3.02 N s/m",
    "--stiffness": "1.147e4 N/m",
    "--nes-mass": "32 g",
    "--restitution": "0.6",
}
BOTH = {**RIG, "--base-amplitude": "0.25 mm", "--release": "30 mm"}
KEYS = [
    "A_1",
    "A_2",
    "F_c",
    "b_c_published_mm",
    "b_c_exact_mm",
    "b_t_published_mm",
    "b_t_exact_mm",
    "least_mean_mm",
    "least_max_mm",
    "robust_mm",
    "captured_share",
    "amplitude_mean_mm",
    "amplitude_max_mm",
    "bare_amplitude_mm",
    "tmd_amplitude_mm",
]


def call(options: dict[str, str], *more: str) -> int:
    """The command without its simulation, which has tests of its own."""
    words = [word for pair in options.items() for word in pair]
    return main(["design", *words, "--theory-only", *more])


def check_schema(answer: dict[str, object]) -> None:
    """Against docs/design.schema.json."""
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((Path(__file__).parents[2] / "docs" / "design.schema.json").read_text())
    jsonschema.Draft7Validator.check_schema(schema)
    assert list(jsonschema.Draft7Validator(schema).iter_errors(answer)) == []


def test_json_has_the_contract_keys_and_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(BOTH, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer)[: len(KEYS)] == KEYS
    assert answer["A_1"] == pytest.approx(0.15717673, abs=5e-9)
    assert answer["A_2"] == pytest.approx(0.73213987, abs=5e-9)
    assert answer["F_c"] == pytest.approx(1.08099, abs=5e-6)
    assert answer["b_c_published_mm"] == pytest.approx(33.968, abs=5e-4)
    assert answer["b_c_exact_mm"] == pytest.approx(33.923, abs=5e-4)
    assert answer["b_t_published_mm"] == pytest.approx(50.0)
    assert answer["b_t_exact_mm"] == pytest.approx(40.976, abs=5e-4)


def test_what_was_not_asked_is_null(capsys: pytest.CaptureFixture[str]) -> None:
    assert call({"--restitution": "0.6", "--release": "20 mm"}, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert list(answer)[: len(KEYS)] == KEYS
    assert answer["b_c_exact_mm"] is None
    assert answer["F_c"] is None
    assert answer["b_t_exact_mm"] == pytest.approx(27.317, abs=5e-4)
    check_schema(answer)


def test_table_shows_intervals_and_sensitivities(capsys: pytest.CaptureFixture[str]) -> None:
    assert call({**BOTH, "--mass": "4.7 +- 0.05 kg"}) == 0
    text = capsys.readouterr().out
    assert re.search(r"^  b_c, G = 0.25 mm +33.97   33.92 +33.32 to 34.53$", text, re.M)
    # the interval: 6.190 mm/kg x 0.05 kg x 1.96
    assert re.search(r"^  M +6\.1899 mm/kg   \+0\.291 mm", text, re.M)
    assert "no error bars given" in text  # of b_t, which M does not enter


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "nothing to design for: give --base-amplitude '0.25 mm' or --release '30 mm'"),
        (
            {"--mass": "4.7 kg", "--base-amplitude": "0.25 mm"},
            "values are missing: give --damping '3.02 N s/m', --stiffness '1.147e4 N/m', "
            "--nes-mass '32 g', --restitution '0.6'",
        ),
        ({**BOTH, "--mass": "4.7"}, "--mass: the unit is missing"),
        ({**BOTH, "--mass": "4.7 V"}, "--mass: 'V' is a unit of voltage"),
        ({**BOTH, "--mass": "-4.7 kg"}, "mass M = -4.7: expected kg, above zero"),
        ({**BOTH, "--nes-mass": "0 g"}, "--nes-mass: found 0.0 kg, expected above zero"),
        ({**BOTH, "--restitution": "1.2"}, "restitution r = 1.2: expected a number from 0 to 1"),
        ({**BOTH, "--base-amplitude": "0 mm"}, "--base-amplitude: found 0"),
        (
            {**RIG, "--base-amplitude": "1 mm", "--restitution": "1", "--damping": "0 N s/m"},
            "no stable orbit",
        ),
        (
            {**BOTH, "--base-amplitude": "0.3:0.2 mm"},
            "--base-amplitude: found the range '0.3:0.2 mm'; write the smaller value first",
        ),
        ({**BOTH, "--frequency": "8 kg"}, "--frequency: 'kg' is a unit of mass"),
        ({**BOTH, "--friction": "-0.1 m/s^2"}, "--friction: expected zero or above"),
        ({**BOTH, "--friction": "0.1"}, "--friction: the unit is missing"),
    ],
)
def test_one_clear_line(
    options: dict[str, str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(options) == 1
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_a_slip_of_a_unit_is_remarked_once(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def remarking(_: object) -> int:
        for _ in range(2):
            Rig(Oscillator(M=0.032, c1=3.02, k1=1.147e4), [NES(m=4.7, b=1e-3, r=0.6)])
        return 0

    monkeypatch.setattr("vinesexp.commands.design.run", remarking)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert call(BOTH) == 0
    assert capsys.readouterr().err.count("m = 4.7 kg is more than the mass M = 0.032 kg") == 1


def test_an_option_given_twice_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(BOTH, "--mass", "4.8 kg") == 1
    assert "--mass: given 2 times (4.7 kg, 4.8 kg); give it once" in capsys.readouterr().err
    assert call(BOTH, "--seed", "1", "--seed", "2") == 1
    assert "--seed: given 2 times (1, 2); give it once" in capsys.readouterr().err
    assert call(BOTH, "--html", "a.html", "--html", "b.html") == 1
    assert "--html: given 2 times (a.html, b.html)" in capsys.readouterr().err
    assert call(BOTH, "--html", "a.pdf") == 1
    assert "'.pdf' is not a page" in capsys.readouterr().err


@pytest.mark.long
def test_a_simulated_answer_has_every_key_and_warns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rig of Table 2 off resonance: measured elsewhere, best b tried 20.5 mm (3.86 mm) at 8 Hz."""
    words = [w for pair in {**RIG, "--base-amplitude": "0.25 mm"}.items() for w in pair]
    picture = tmp_path / "d.svg"
    sheet = tmp_path / "d.html"
    code = main(
        [
            *("design", *words, "--frequency", "8.0 Hz", "--release", "20 mm", "--json"),
            *("--plot", str(picture), "--html", str(sheet)),
        ]
    )
    assert code == 0
    answer = json.loads(capsys.readouterr().out)
    check_schema(answer)
    page = sheet.read_text(encoding="utf-8")
    for text in (
        f"{answer['robust_mm']:.4g}",
        "base amplitude G</b> 0.25 mm",
        "without ball (s)</th>",
        answer["headline"][:40],
        "<svg",
    ):
        assert text in page
    assert not re.search(r'(?:src|href)="(?!#)', page), "the page needs nothing beside it"
    up, down = answer["slow_sweep"]
    assert (up["from_hz"], up["to_hz"]) == (down["to_hz"], down["from_hz"])
    assert up["largest_mm"] > up["largest_running_mean_mm"] > answer["robust"]["rest_mean_mm"]
    assert list(answer)[: len(KEYS)] == KEYS
    assert all(answer[key] is not None for key in KEYS)
    assert 17.0 < answer["least_mean_mm"] < 22.0 < answer["b_c_exact_mm"]
    assert answer["least_mean"]["rest_mean_mm"] == pytest.approx(3.9, abs=0.1)
    assert answer["robust_mm"] < answer["least_mean_mm"]
    assert answer["captured_share"] > 0.85
    assert answer["bare_amplitude_mm"] == pytest.approx(6.687, abs=2e-3)
    said = " ".join(answer["warnings"])
    assert "the published b_c, 33.97 mm, holds at resonance" in said
    assert "here the exact one is 27.36 mm" in said
    assert "is not reached from rest" in said
    names = re.findall(r"with the (.*) clearance a ball at rest in the middle", said)[0]
    for name, key in (("robust", "robust"), ("least-mean", "least_mean")):
        assert (name in names) != answer[key]["centre_touched"]
    assert not answer["least_mean"]["centre_touched"]
    assert answer["inputs"]["M"] == [{"value": 4.7, "std_error": 0.0}]
    assert picture.stat().st_size > 5000


def test_several_balls_and_ranges(capsys: pytest.CaptureFixture[str]) -> None:
    options = {**RIG, "--nes-mass": "32 g; 16 g", "--base-amplitude": "0.15:0.25 mm"}
    assert call({**options, "--frequency": "7.7:7.9 Hz"}) == 0
    text = capsys.readouterr().out
    assert re.search(r"nes mass m +?= 32 g; 16 g", text)
    assert "b_c, G = 0.25 mm" in text


def test_an_orbit_that_leaves_its_cavity_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """Stable on paper up to 1.573 mm, but its ball would pass a wall between the impacts."""
    rig = {"--mass": "1 kg", "--damping": "0.02 N s/m", "--stiffness": "1 N/m"}
    rig |= {"--nes-mass": "50 g", "--restitution": "0.3", "--base-amplitude": "1 mm"}
    assert call({**rig, "--frequency": "0.0318309886 Hz"}) == 1
    assert "no stable orbit" in capsys.readouterr().err


IDENTIFIED = """parameter,value,std_error,ci95_low,ci95_high,unit,method,records
f0,7.862,0.001,7.86,7.864,Hz,combined,a;b
M,4.69,0.05,4.6,4.8,kg,impacts,a
M,4.71,0.02,4.67,4.75,kg,combined,a;b
c1,3.02,0.1,2.8,3.2,N s/m,combined,a
k1,1.147e4,30,1.14e4,1.15e4,N/m,combined,a
r,0.6,0.01,0.58,0.62,,combined,a
"""


def test_identified_values_in_place_of_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "identified.csv"
    file.write_text(IDENTIFIED)
    options = {"--identified": str(file), "--nes-mass": "32 g", "--base-amplitude": "0.25 mm"}
    assert call(options) == 0
    text = capsys.readouterr().out
    assert re.search(r"mass M +?= 4.710 \+- 0.039 kg", text), "combined; 1.96 of 0.02"
    assert re.search(r"restitution r +?= 0.600 \+- 0.020", text)
    assert call({**options, "--identified": str(tmp_path)}) == 0, "the folder it is in will do"
    assert capsys.readouterr().out == text
    assert call({**options, "--mass": "4.7 kg"}, "--json") == 0, "an option wins over the file"
    b_c = json.loads(capsys.readouterr().out)["b_c_exact_mm"]
    assert b_c == pytest.approx(33.923, abs=5e-4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty, expected the columns parameter,value,std_error,unit,method"),
        ("parameter,value,std_error,units,method\n", "line 1: has no column 'unit' but 'units'"),
        ("parameter,value,std_error,unit,method\n", "holds no row with method 'combined'"),
        (IDENTIFIED.replace("4.71", "four"), "line 4: found 'four' in column value"),
        (
            IDENTIFIED.replace("4.71,0.02,4.67,4.75,kg", "4.71,0.02,4.67,4.75,N"),
            "line 4: 'N' is a unit of force, expected a unit of mass",
        ),
        (IDENTIFIED.rstrip("\n"), "is cut off"),
    ],
)
def test_bad_identified_is_an_error(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "identified.csv"
    file.write_text(text)
    assert call({"--identified": str(file), "--nes-mass": "32 g", "--release": "30 mm"}) == 1
    error = capsys.readouterr().err
    assert message in error
    assert str(file) in error
    assert call({"--identified": str(tmp_path / "no.csv"), "--release": "30 mm"}) == 1
    assert "no.csv: is missing; run the identify step first" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("ending", ["svg", "pdf", "png"])
def test_a_picture_drawn_on_another_day_has_the_same_bytes(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure, (axis,) = new_figure()
    axis.plot([0.0, 1.0 / 3.0], [0.0, 2.0], label="x")
    once, again = (tmp_path / f"{name}.{ending}" for name in ("once", "again"))
    for file, second in ((once, "0"), (again, "1000000000")):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", second)
        draw(figure, file)
    assert once.read_bytes() == again.read_bytes()
    assert once.stat().st_size > 3000


@pytest.mark.long
def test_plot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sim.svg"
    assert call(BOTH, "--plot", str(file)) == 0
    assert file.stat().st_size > 5000
    first = file.read_bytes()
    assert call(BOTH, "--plot", str(file)) == 1
    assert "is there already" in capsys.readouterr().err
    assert call(BOTH, "--plot", str(file), "--force") == 0
    assert file.read_bytes() == first, "the same picture gives the same bytes"
    assert call(BOTH, "--plot", str(tmp_path / "sim.bmp")) == 1
    assert "cannot draw '.bmp'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("flag", "text"),
    [
        ("--release", "1e300 m"),
        ("--release", "1e-300 m"),
        ("--base-amplitude", "1e300 m"),
        ("--frequency", "1e9:2e9 Hz"),
        ("--stiffness", "1e308 N/m"),
        ("--nes-mass", "32 g; 1e-300 kg"),
        ("--friction", "1e300 m/s^2"),
        ("--coulomb-damping", "1e300 N"),
        ("--quadratic-damping", "1e300 kg/m"),
    ],
)
def test_a_size_that_no_rig_has_is_one_line(
    flag: str, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call({**BOTH, flag: text}) == 1
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert f"{flag}: found '{text}', expected" in shown


def test_a_picture_that_cannot_be_written_does_not_cost_the_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    occupied = tmp_path / "file"
    occupied.write_text("mine")
    assert call(BOTH, "--json", "--plot", str(occupied / "sim.png")) == 1
    shown = capsys.readouterr()
    assert json.loads(shown.out)["b_t_published_mm"] == pytest.approx(50.0)
    assert shown.err.count("\n") == 1
    assert "cannot be drawn there" in shown.err


def test_a_sheet_without_simulation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sheet.html"
    assert call(BOTH, "--html", str(file)) == 0
    page = file.read_text(encoding="utf-8")
    assert "33.92" in page
    assert "40.98" in page
    assert "<svg" not in page


@pytest.mark.long
def test_a_release_alone_is_simulated_and_told_by_its_measures(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = [w for pair in {**RIG, "--release": "20 mm"}.items() for w in pair]
    assert main(["design", *words, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    check_schema(answer)
    found = answer["release_simulated"]
    by_b = {round(row["b_mm"], 1): row for row in found["clearances"]}
    assert by_b[27.3]["captured_share"] > 0.6
    assert answer["robust_mm"] is None
    assert main(["design", *words]) == 0
    assert "pumping time (s)" in capsys.readouterr().out


def test_much_work_is_stated_before_it_is_begun(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("vinesexp.design.ask.advise", stop)
    more = {**RIG, "--base-amplitude": "0.25 mm", "--effort": "500"}
    words = [w for pair in more.items() for w in pair]
    assert main(["design", *words]) == 130
    said = capsys.readouterr()
    assert re.search(r"500 times the usual work: up to about [\d,]+ s", said.err)
    assert "stopped before its end" in said.out.replace("\n", " ")
    assert "b_c, G = 0.25 mm" in said.out
