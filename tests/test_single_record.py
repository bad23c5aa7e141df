"""One record in a notebook gives what the same record gives in a campaign."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import vinesexp
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate
from vinesexp.errors import ParameterError, RecordError
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths

RATE = 10_000.0


@pytest.fixture(scope="module")
def periodic() -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Ten seconds of the published rig, lasers and accelerometer, and its true impacts."""
    rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.03, r=0.6)])
    base = Harmonic(amplitude=0.25e-3, frequency=7.862)
    motion = simulate(rig, base, Release(y0=[0.0299]), duration=22.0)
    t = 12.0 + np.arange(100_000) / RATE
    x, v = motion.at(t)
    hits = motion.impacts
    inside = (hits["time"] > 12.0) & (hits["time"] < 22.0 - 1e-3)
    times, jump = hits["time"][inside], (hits["v_after"] - hits["v_before"])[inside]
    w = 2.0 * np.pi * 7.862
    xe = 0.25e-3 * np.sin(w * t)
    a = -(1.147e4 * (x - xe) + 3.02 * (v - 0.25e-3 * w * np.cos(w * t))) / 4.7
    for at, dv in zip(times, jump, strict=True):
        k = np.flatnonzero((t > at) & (t < at + 4e-4))
        a[k] += dv * np.pi / (2 * 4e-4) * np.sin(np.pi * (t[k] - at) / 4e-4)
    rng = np.random.default_rng(3)
    channels = {
        "base": xe + rng.normal(0.0, 2e-6, t.size),
        "displacement": x + rng.normal(0.0, 6e-6, t.size),
        "acceleration": a + rng.normal(0.0, 0.3, t.size),
    }
    return channels, times - 12.0


@pytest.mark.long
def test_impacts_regime_and_values_of_one_record(periodic):
    channels, times = periodic
    found = vinesexp.analyse(
        channels, "10 kHz", test="periodic", clearance="30 mm", nes_mass=0.032,
        base_amplitude=0.25e-3, frequency=7.862,
    )  # fmt: skip
    assert abs(len(found.impacts) - len(times)) <= 2
    assert np.abs(found.impacts["time_s"].to_numpy()[:, None] - times).min(axis=1).max() < 5e-4
    assert found.regime["regime"] == "two symmetric"
    combined = found.identified[found.identified["method"] == "combined"].set_index("parameter")
    assert combined.loc["r", "ci95_low"] < 0.6 < combined.loc["r", "ci95_high"]
    assert float(found["displacement"].max()) == pytest.approx(channels["displacement"].max())


@pytest.mark.long
def test_the_same_file_in_a_campaign_gives_the_same_numbers(tmp_path: Path):
    t = np.arange(4000) / 500.0
    x = 20.0 * np.exp(-0.4 * t) * np.cos(2 * np.pi * 7.862 * t)
    x += np.random.default_rng(0).normal(0.0, 0.006, t.size)
    table = np.column_stack([t, x])
    np.savetxt(
        tmp_path / "a.csv", table, fmt="%.6f", delimiter=",", header="Time,Laser\ns,mm", comments=""
    )
    (tmp_path / "campaign.yaml").write_text(
        "channels: {displacement: {column: Laser, quantity: displacement, unit: mm}}\n"
        "time: {column: Time, unit: s}\n"
    )
    (tmp_path / "records.csv").write_text("record,file,test\nrecord,a.csv,ringdown\n")
    analyse_campaign(load_campaign(tmp_path), paths=ResultPaths(tmp_path / "results"))
    channels, rate = vinesexp.read_file(tmp_path / "a.csv", {"displacement": ("Laser", "mm")})
    found = vinesexp.analyse(channels, rate, test="ringdown", folder=tmp_path / "kept")
    theirs = vinesexp.open_results(tmp_path / "results")
    assert found.identified.equals(theirs.identified)
    assert found.estimates.equals(theirs.record("record").estimates)
    assert (tmp_path / "kept" / "records" / "record.nc").is_file()


@pytest.mark.parametrize(
    ("channels", "given", "message"),
    [
        ({"displacment": np.ones(9)}, {}, "did you mean 'displacement'"),
        ({"displacement": np.ones((3, 3))}, {}, "channel displacement: found 3x3"),
        ({"displacement": ["a", "b"]}, {}, "channel displacement: found ['a', 'b'], expected num"),
        ({"displacement": np.ones(9) + 0j}, {}, "channel displacement: found complex numbers"),
        (np.ones(9), {}, "channels: found ndarray, expected each channel by its role"),
        ({0: np.ones(9)}, {}, "unknown channel '0'"),
        ({"displacement": np.ones(9)}, {"frequency": np.ones(2) * 1j}, "found complex numbers"),
        ({}, {}, "found none"),
        ({"displacement": np.ones(9), "base": np.ones(8)}, {}, "displacement 9, base 8"),
        ({"displacement": np.ones(9)}, {"test": "ringdwn"}, "did you mean 'ringdown'"),
        ({"displacement": np.ones(9)}, {"clearance": "34"}, "clearance: the unit is missing"),
        ({"displacement": np.ones(9)}, {"clearance": -1.0}, "clearance: found -1.0"),
        ({"displacement": np.ones(9)}, {"nes_mass": "32 mm"}, "nes_mass: 'mm' is a unit of"),
        ({"displacement": np.ones(9)}, {"frequency": (1.0, 2.0, 3.0)}, "a pair"),
        ({"displacement": np.ones(9)}, {"settings": "impacts.treshold = 7"}, "'threshold'"),
    ],
)
def test_a_mistake_is_one_line_that_names_the_argument(channels, given, message):
    with pytest.raises(ParameterError) as error:
        vinesexp.analyse(channels, 100.0, **{"test": "ringdown", **given})
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.long
def test_a_masked_sample_is_one_that_is_missing():
    t = np.arange(4000) / 500.0
    x = 5e-3 * np.exp(-0.3 * t) * np.cos(2.0 * np.pi * 7.862 * t)
    x[:200] = 1.0  # of a laser that was not switched on
    masked = np.ma.masked_greater(x, 0.5)
    masked_, cut = (
        vinesexp.analyse({"displacement": one}, np.float32(500.0), test="ringdown").identified
        for one in (masked, x[200:])
    )
    values = [one.query("parameter == 'f0'")["value"].iloc[-1] for one in (masked_, cut)]
    assert values[0] == pytest.approx(values[1], rel=1e-9)
    assert values[0] == pytest.approx(7.862, rel=1e-3)
    masked[1000] = np.ma.masked
    found = vinesexp.analyse({"displacement": masked}, 500.0, test="ringdown")
    assert found.identified.query("parameter == 'f0'")["value"].iloc[-1] == pytest.approx(
        values[0], rel=1e-6
    )
    assert (found.checks.check == "gaps").any()


def test_a_number_of_numpy_stands_for_one_value():
    channels = {"displacement": np.ones(9)}
    for frequency in (np.float32(4.48), np.array(4.48)):
        with pytest.raises(RecordError):  # of its samples, not of the number
            vinesexp.analyse(channels, 100.0, test="periodic", frequency=frequency)


@pytest.mark.parametrize("given", ["displacement", ("Laser",), ("Laser", "mm", 3)])
def test_a_column_without_its_unit_is_asked_for(given, tmp_path: Path):
    file = tmp_path / "a.csv"
    file.write_text("Time,Laser\ns,mm\n0,1\n1,2\n2,3\n")
    with pytest.raises(ParameterError, match=r"channel displacement: found .*, expected a column"):
        vinesexp.read_file(file, {"displacement": given})


def test_a_file_is_read_in_its_own_unit_of_time_and_asked_for_in_its_unit(tmp_path: Path):
    file = tmp_path / "a.csv"
    file.write_text("Time (ms),Laser (mm)\n0,1\n5,2\n10,4\n")
    assert vinesexp.read_file(file, {"displacement": ("1", "mm")}).sample_rate == pytest.approx(200)
    with pytest.raises(RecordError, match=r"the header says 'mm'.*, stated is 'm'$"):
        vinesexp.read_file(file, {"displacement": ("1", "m")})


def test_samples_that_cannot_be_used_are_refused_as_in_a_campaign():
    x = np.ones(1000)
    with pytest.raises(RecordError, match="shows no motion") as error:
        vinesexp.analyse({"displacement": x}, 100.0, test="ringdown")
    assert "/" not in str(error.value), "no temporary file is named"


ROOMS = sorted(
    path.parent.name
    for path in Path(vinesexp.__file__).parent.glob("*/__init__.py")
    if "lazy(" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_has_its_public_names(room):
    module = importlib.import_module(f"vinesexp.{room}")
    assert dir(module) == module.__all__ != []
    for name in module.__all__:
        assert callable(getattr(module, name)), name
    with pytest.raises(AttributeError, match="nothing_of_that_name"):
        module.nothing_of_that_name  # noqa: B018


def test_every_public_name_is_there():
    for name in vinesexp.__all__:
        assert getattr(vinesexp, name) is not None
    assert dir(vinesexp) == vinesexp.__all__


@pytest.mark.long
def test_linear_algebra_has_one_thread_while_a_record_is_analysed(periodic):
    """In a notebook numpy is loaded with a thread a core, which costs more than it gains."""
    seen: list[int] = []

    def threads() -> list[int]:
        return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]

    def detector(acceleration, sample_rate):
        seen.extend(threads())
        return []

    begin = {role: values[:20_000] for role, values in periodic[0].items()}
    with threadpool_limits(2, user_api="blas"):
        usual = threads()
        vinesexp.analyse(begin, RATE, test="periodic", clearance="30 mm", detector=detector)
        assert threads() == usual
    assert set(seen) == {1}


@pytest.mark.long
def test_a_decay_that_an_accelerometer_clips_keeps_its_damping():
    """Clipped samples counted as they were: the damping ratio was a quarter too small."""
    t = np.arange(24_000) / 2000.0
    w, zeta = 2.0 * np.pi * 7.9, 0.004
    a = 50.0 * np.exp(-zeta * w * t) * np.cos(w * t) + 0.05 * np.random.default_rng(0).normal(
        size=t.size
    )
    found = vinesexp.analyse({"acceleration": np.clip(a, -19.6, 19.6)}, 2000.0, test="ringdown")
    (gaps,) = found.checks.query("check == 'gaps'")["detail"]
    assert "clipped at the end of its range" in gaps
    values = found.identified.query("method == 'log decrement'").set_index("parameter")["value"]
    assert values["zeta"] == pytest.approx(zeta, rel=1e-3)
