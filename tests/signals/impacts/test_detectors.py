"""The usual detectors, chosen by name: on a plain record they find the same impacts."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.streams import stream_of

from vinesexp import Harmonic, analyse
from vinesexp.errors import AnalysisError, ParameterError, VinesexpError
from vinesexp.settings.stages import DETECTORS, ImpactSettings, Settings, changed_by_text
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.candidates import Stream
from vinesexp.signals.impacts.detectors import detect, hand_over
from vinesexp.signals.impacts.find import impacts_of_record

RATE, CONTACT = 1e4, 4e-4


def trace(times: np.ndarray, *, seconds: float, noise: float = 0.3, seed: int = 0) -> np.ndarray:
    """Half-sine contacts of alternating sign, means over each sample, and white noise."""
    t = np.arange(round(seconds * RATE)) / RATE
    a = noise * np.random.default_rng(seed).standard_normal(t.size)
    w = np.pi / CONTACT
    for k, time in enumerate(times):
        near = slice(*np.searchsorted(t, (time - CONTACT, time + CONTACT)))
        edges = np.clip(np.stack([t[near] - 0.5 / RATE, t[near] + 0.5 / RATE]) - time, -2e-4, 2e-4)
        a[near] += (-1) ** k * 60.0 * RATE * (np.sin(w * edges[1]) - np.sin(w * edges[0])) / w
    return a


TIMES = 0.1 + 0.0637 * np.arange(60) + np.random.default_rng(1).uniform(-2e-3, 2e-3, 60)


@pytest.mark.parametrize("name", DETECTORS)
def test_every_detector_finds_plain_impacts(name: str) -> None:
    stream = stream_of(trace(TIMES, seconds=4.0), RATE)
    found = detect(stream, ImpactSettings(detector=name))
    assert found.time.size == TIMES.size
    assert np.abs(found.time - TIMES).max() < 0.5 / RATE
    assert (np.sign(found.jump) == (-1.0) ** np.arange(60)).all()
    area = 60.0 * 2.0 * CONTACT / np.pi
    assert np.median(np.abs(found.jump)) == pytest.approx(area, rel=0.05)
    assert ((found.time - TIMES) / found.time_error).std() < 1.5
    assert not found.crowded.any()


@pytest.mark.parametrize("name", DETECTORS)
def test_a_ringing_that_lasts_longer_than_apart_is_no_impact(name: str) -> None:
    """2 kHz with a damping of 0.02: over the threshold for 11 ms, where `apart` is 3 ms."""
    a, w = trace(TIMES, seconds=4.0), 2.0 * np.pi * 2e3
    t = np.arange(a.size) / RATE
    for k, time in enumerate(TIMES):
        s = t[t > time] - time
        a[t > time] += (-1) ** k * 30.0 * np.exp(-0.02 * w * s) * np.sin(w * s)
    found = detect(stream_of(a, RATE), ImpactSettings(detector=name))
    assert found.time.size == TIMES.size
    assert np.abs(found.time - TIMES).max() < 3e-4


@pytest.mark.parametrize("name", [name for name in DETECTORS if name != "sta_lta"])
@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_is_no_impact(name: str, seed: int) -> None:
    stream = stream_of(trace(np.empty(0), seconds=40.0, seed=seed), RATE)
    assert detect(stream, ImpactSettings(detector=name)).time.size == 0


@pytest.mark.parametrize("name", DETECTORS)
def test_chunks_leave_no_seam(name: str) -> None:
    """Three chunks of a quarter of a million samples, impacts at their very ends."""
    times = np.sort(np.append(5.0 + 0.5 * np.arange(130), [26.2144, 52.4287]))
    stream = stream_of(trace(times, seconds=78.0), RATE)
    found = detect(stream, ImpactSettings(detector=name, ratio=5.0))
    assert found.time.size == times.size
    assert np.abs(found.time - times).max() < 1.0 / RATE


@pytest.mark.parametrize("name", DETECTORS)
def test_missing_samples_and_an_empty_record(name: str) -> None:
    a = trace(TIMES, seconds=4.0)
    a[12_000:12_400] = np.nan
    found = detect(stream_of(a, RATE), ImpactSettings(detector=name))
    away = np.abs(TIMES - 1.22) > 0.03
    assert np.abs(found.time[:, np.newaxis] - TIMES[away]).min(axis=0).max() < 0.5 / RATE
    empty = Stream(lambda begin, end: np.empty(0), 0, RATE)
    assert detect(empty, ImpactSettings(detector=name)).time.size == 0


@pytest.mark.parametrize("name", DETECTORS)
def test_a_record_is_analysed_with_the_detector_of_its_settings(
    name: str, measure, tmp_path: Path
) -> None:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=8.0)
    settings = changed_by_text(Settings(), f"impacts.detector = {name}")
    condition(record.path, tmp_path / "c.nc", f0_hint=7.862, settings=settings)
    found = impacts_of_record(
        record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(0.03,), settings=settings
    )
    assert found.n == record.time.size
    assert (found.side == record.side).all()
    assert np.abs(found.time_s - record.time).max() < 1e-4


def test_parts_can_be_switched_off(measure, tmp_path: Path) -> None:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=8.0)
    text = "slopes.use = no | impacts.learn = no | impacts.split = no"
    settings = changed_by_text(Settings(), text)
    condition(record.path, tmp_path / "c.nc", f0_hint=7.862, settings=settings)
    found = impacts_of_record(
        record.path, tmp_path / "c.nc", tmp_path / "i.csv", clearance=(0.03,), settings=settings
    )
    assert found.n == record.time.size
    assert np.isnan(found.jump_displacement_m_s).all()
    np.testing.assert_allclose(found.velocity_jump_m_s, found.jump_acceleration_m_s, rtol=1e-12)


def loud(acceleration: np.ndarray, sample_rate: float) -> np.ndarray:
    """A detector of one's own: the loudest sample of each stretch above 20 m/s^2."""
    above = np.flatnonzero(np.abs(acceleration) > 20.0)
    runs = np.split(above, np.flatnonzero(np.diff(above) > 30) + 1) if above.size else []
    return np.array([r[np.argmax(np.abs(acceleration[r]))] for r in runs]) / sample_rate


def fails(acceleration: np.ndarray, sample_rate: float) -> np.ndarray:
    raise RuntimeError("no idea")


def test_a_function_of_ones_own_is_named_in_the_settings() -> None:
    stream = stream_of(trace(TIMES, seconds=4.0), RATE)
    settings = changed_by_text(Settings(), f"impacts.detector = {hand_over(loud)}")
    found = detect(stream, settings.impacts)
    assert found.time.size == TIMES.size
    assert np.abs(found.time - TIMES).max() < 1.0 / RATE
    assert (np.sign(found.jump) == (-1.0) ** np.arange(60)).all()
    assert np.median(np.abs(found.jump)) == pytest.approx(60.0 * 2.0 * CONTACT / np.pi, rel=0.1)


def test_a_detector_is_imported_by_its_name(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "mydetectors.py").write_text("def never(a, rate):\n    return []\n")
    monkeypatch.syspath_prepend(tmp_path)
    settings = changed_by_text(Settings(), "impacts.detector = mydetectors:never")
    assert detect(stream_of(trace(TIMES, seconds=4.0), RATE), settings.impacts).time.size == 0


def test_a_package_offers_a_detector_by_an_entry_point(tmp_path: Path, monkeypatch) -> None:
    """As an installed package has it: its module, and entry_points.txt beside it."""
    (tmp_path / "theirs.py").write_text("def never(a, rate):\n    return []\n")
    about = tmp_path / "theirs-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[vinesexp.detectors]\nquiet = theirs:never\n")
    monkeypatch.syspath_prepend(tmp_path)
    settings = changed_by_text(Settings(), "impacts.detector = quiet")
    assert detect(stream_of(trace(TIMES, seconds=4.0), RATE), settings.impacts).time.size == 0


@pytest.mark.parametrize(
    ("name", "says"),
    [("nowhere.at_all:mine", "cannot be imported"), ("math:nothing", "cannot be imported")],
)
def test_a_detector_that_is_not_there_is_one_line(name: str, says: str) -> None:
    settings = changed_by_text(Settings(), f"impacts.detector = {name}")
    with pytest.raises(ParameterError, match=says):
        detect(stream_of(trace(TIMES, seconds=4.0), RATE), settings.impacts)


def test_a_detector_that_fails_or_gives_no_times_is_one_line() -> None:
    stream = stream_of(trace(TIMES, seconds=4.0), RATE)
    with pytest.raises(AnalysisError, match="failed: RuntimeError: no idea"):
        detect(stream, ImpactSettings(detector=hand_over(fails)))

    def samples(acceleration: np.ndarray, sample_rate: float) -> list[float]:
        return [30_000.0]  # a sample, not a time

    with pytest.raises(AnalysisError, match="expected times in s"):
        detect(stream, ImpactSettings(detector=hand_over(samples)))


def test_an_unknown_word_says_how_to_name_ones_own() -> None:
    with pytest.raises(VinesexpError, match="module:function"):
        changed_by_text(Settings(), "impacts.detector = tempalte")


@pytest.mark.long
def test_analyse_takes_a_function(measure) -> None:
    record = measure(b=[0.03], drive=Harmonic(0.25e-3, 7.862), start=10.0, duration=8.0)
    channels = {role: record.channels[role] for role in ("displacement", "acceleration")}
    found = analyse(
        channels, 1e4, test="periodic", clearance=0.03, nes_mass=0.032, frequency=7.862,
        base_amplitude=0.25e-3, detector=loud,
    )  # fmt: skip
    assert len(found.impacts) == pytest.approx(2 * 8.0 * 7.862, abs=4)
