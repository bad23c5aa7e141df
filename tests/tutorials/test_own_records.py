"""docs/tutorials/own-records.md, line by line, to the report."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.load import load_campaign

REPOSITORY = Path(__file__).resolve().parents[2]
PAGE = REPOSITORY / "docs/tutorials/own-records.md"

pytestmark = [pytest.mark.workflow, pytest.mark.long]


def expanded(word):
    """As the shell does with a star."""
    return sorted(map(str, Path().glob(word))) or [word] if "*" in word else [word]


@pytest.mark.parametrize("dry", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_the_tutorial_works_as_written(dry, tmp_path, monkeypatch, capsys):
    """Line by line; the run itself, which takes most of a minute, is only planned where `dry`."""
    monkeypatch.chdir(tmp_path)
    steps = re.findall(r"```(\w+)( [^\n]*)?\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    done = []
    for kind, name, text in steps:
        if kind != "sh":
            Path(name.strip()).write_text(text, encoding="utf-8")
            continue
        for line in text.strip().splitlines():
            words = shlex.split(line)
            done.append(words[:2])
            if words[0] == "cp":
                shutil.copytree(words[2], words[3])
            elif words[:2] == ["vinesexp", "run"]:
                command = [
                    sys.executable,
                    "-m",
                    "vinesexp.cli",
                    *words[1:],
                    *(["-n"] if dry else []),
                ]
                ran = subprocess.run(command, capture_output=True, text=True, check=False)
                assert ran.returncode == 0, ran.stderr
                planned = ran.stdout + ran.stderr
            else:
                assert words[0] == "vinesexp"
                words = [one for word in words for one in expanded(word)]
                assert main(words[1:]) == 0, capsys.readouterr().out
    assert [words[1] for words in done] == [
        *("simulate", "-r", "look", "look", "init", "check", "run")
    ]
    assert Path("look.png").is_file()
    tests = [record.test for record in load_campaign(Path("mytests")).records]
    assert tests == ["ringdown", "transient", "periodic"]
    assert "next: vinesexp run mytests" in capsys.readouterr().out
    if dry:
        assert "report" in planned
        return
    report = Path("results/mytests/report.html").read_text(encoding="utf-8")
    assert report.rstrip().endswith("</html>")
    for word in ("My tests", "decay_1", "release_b24", "shaker"):
        assert word in report
