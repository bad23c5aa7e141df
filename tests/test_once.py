"""What stands or runs once: constants of the field in the source, costly looks at a record."""

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import vinesexp
from vinesexp.pipeline import analyse_record
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.signals.channel_agreement import agreement_of
from vinesexp.signals.clipping import converter_range
from vinesexp.signals.impacts.impact_table import read_impacts

ROOT = Path(vinesexp.__file__).parent


def nodes(text: str) -> Iterator[tuple[str, ast.AST]]:
    """Of the files whose text holds a pattern; parsing all of them takes seconds."""
    for path in sorted(ROOT.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if re.search(text, source):
            for node in ast.walk(ast.parse(source)):
                yield path.relative_to(ROOT).as_posix(), node


def test_the_95_percent_quantile_stands_once():
    places = [
        file
        for file, node in nodes(r"1\.9[56]|19[56]")
        if isinstance(node, ast.Constant)
        and isinstance(node.value, float)
        and round(node.value, 2) == 1.96
    ]
    assert places == ["units.py"]


@pytest.mark.long
def test_the_values_of_a_rig_are_listed_once():
    """In `rig.OF_RIG`, with their names and limits."""
    values = {"M", "c1", "k1", "r", "m"}
    places = [
        file
        for file, node in nodes(r"(?s)\A" + "".join(rf"(?=.*[\"']{name}[\"'])" for name in values))
        if isinstance(node, ast.Tuple | ast.List | ast.Set)
        and {e.value for e in node.elts if isinstance(e, ast.Constant)} == values
    ]
    assert places == []


def test_kinds_of_arrays_are_named_once():
    kinds = r"(?m)^\w+ = NDArray\[np\.(?:float64|int64|bool_|complex128)\]"
    named = {
        path.relative_to(ROOT).as_posix(): len(found)
        for path in ROOT.rglob("*.py")
        if (found := re.findall(kinds, path.read_text(encoding="utf-8")))
    }
    assert named == {"arrays.py": 4}


def counted(monkeypatch: pytest.MonkeyPatch, function: Callable) -> list[str]:
    """Put a counter in place of a function wherever the package has imported it."""
    calls: list[str] = []

    def count(*given, **named):
        calls.append(function.__name__)
        return function(*given, **named)

    for name, module in list(sys.modules.items()):
        if name.startswith("vinesexp") and vars(module).get(function.__name__) is function:
            monkeypatch.setattr(module, function.__name__, count)
    return calls


def write_transient(folder: Path) -> None:
    """Laser and accelerometer of a decay with a velocity jump in each half cycle."""
    rate, w = 5000.0, 2.0 * np.pi * 7.862
    t = np.arange(20_000) / rate
    decay = np.exp(-0.3 * t)
    x, a = 20.0 * decay * np.cos(w * t), -0.02 * w**2 * decay * np.cos(w * t)
    for k, start in enumerate(np.arange(0.03, 3.9, np.pi / w)):
        pulse = np.sin(np.pi * (t - start) / 1e-3)
        a += np.where((t > start) & (t < start + 1e-3), (-1) ** k * 30.0 * pulse, 0.0)
        late = np.maximum(t - start - 0.5e-3, 0.0)
        x += (-1) ** k * 1e3 * (0.06 / np.pi) * np.exp(-0.3 * late) * np.sin(w * late) / w
    noise = np.random.default_rng(0).normal(size=(2, t.size))
    table = np.column_stack([t, x + 0.005 * noise[0], a + 0.05 * noise[1]])
    np.savetxt(
        folder / "run.csv", table, fmt="%.6f", delimiter=",",
        header="Time,Laser,Acc\ns,mm,m/s^2", comments="",
    )  # fmt: skip
    (folder / "campaign.yaml").write_text(
        "known: {nes_mass: 32 g}\n"
        "channels:\n"
        "  displacement: {column: Laser, quantity: displacement, unit: mm}\n"
        "  acceleration: {column: Acc, quantity: acceleration, unit: m/s^2}\n"
        "time: {column: Time, unit: s}\n",
        encoding="utf-8",
    )
    (folder / "records.csv").write_text(
        "record,file,test,clearance_mm,release_mm\nrun,run.csv,transient,30,20\n", encoding="utf-8"
    )


@pytest.mark.long
def test_a_record_is_searched_once_for_its_range_and_its_channels_agreement(tmp_path, monkeypatch):
    write_transient(tmp_path)
    campaign = load_campaign(tmp_path)
    ranges = counted(monkeypatch, converter_range)
    agreements = counted(monkeypatch, agreement_of)
    paths = ResultPaths(tmp_path / "r")
    analyse_record(campaign, campaign.record("run"), paths=paths, strict=True)
    assert read_impacts(paths.impacts("run")).n > 20, "the acceleration was used"
    assert (len(ranges), len(agreements)) == (1, 1)
