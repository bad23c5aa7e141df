"""docs/tutorials/own-records.md, line by line, up to the run itself."""

import re
import shlex
import shutil
from pathlib import Path

from vinesexp.cli import main
from vinesexp.records.campaign import load_campaign

PAGE = Path(__file__).resolve().parents[2] / "docs/tutorials/own-records.md"


def expanded(word):
    """As the shell does with a star."""
    return sorted(map(str, Path().glob(word))) or [word] if "*" in word else [word]


def test_the_tutorial_works_as_written(tmp_path, monkeypatch, capsys):
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
            elif words[0] == "vinesexp":
                # As the shell does with a star.
                words = [
                    w for word in words for w in (sorted(map(str, Path().glob(word))) or [word])
                ]
                assert main(words[1:]) == 0, capsys.readouterr().out
    assert [words[1] for words in done] == [
        *("simulate", "-r", "look", "look", "init", "check", "--config")
    ]
    assert Path("look.png").is_file()
    tests = [record.test for record in load_campaign(Path("mytests")).records]
    assert tests == ["ringdown", "transient", "periodic"]
    assert "next: snakemake --config campaign=mytests" in capsys.readouterr().out
