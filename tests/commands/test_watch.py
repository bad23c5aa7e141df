"""Mistakes in the options of `vinesexp watch`, each one line that names the option."""

import socket

import pytest

from vinesexp.cli import main
from vinesexp.resultslock import hold_results


@pytest.fixture
def bench(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench/campaign.yaml").write_text(
        "channels: {displacement: {column: 1, quantity: displacement, unit: mm}}\n"
    )
    return tmp_path / "bench"


def said(capsys, *options):
    assert main(["watch", "bench", "--no-browser", *options]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_a_port_that_is_none_or_taken(bench, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        for port in (80000, taken.getsockname()[1]):
            line = said(capsys, "--port", str(port))
            assert line.startswith(f"vinesexp watch: --port {port}: no page can be shown there (")


def test_a_time_that_is_none(bench, capsys):
    for text in ("-1", "nan"):
        assert "--quiet: found" in said(capsys, "--quiet", text)
    assert not (bench.parent / "results").exists()


def test_the_option_that_chooses_another_folder_is_named(bench, capsys):
    with hold_results(bench.parent / "held", campaign=bench):
        assert said(capsys, "--results", "held").endswith("(of vinesexp watch: --results DIR)")
    assert main(["watch", "nowhere"]) == 1
    assert "nowhere: no such folder" in capsys.readouterr().err
