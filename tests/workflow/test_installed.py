"""`vinesexp run`: the workflow from a wheel, outside any clone, and what goes on to Snakemake."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import vinesexp
from vinesexp.cli import main
from vinesexp.commands.run import snakemake_command, workflow_home
from vinesexp.errors import ParameterError

pytestmark = pytest.mark.workflow

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """A folder with the installed wheel and nothing else of this project."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    built = subprocess.run(
        [*pip, "wheel", "--no-deps", "--wheel-dir", str(folder), str(REPOSITORY)],
        capture_output=True,
        text=True,
        check=False,
    )
    if built.returncode and "No matching distribution" in built.stderr:
        pytest.skip("what builds a wheel cannot be downloaded here")
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


@pytest.mark.slow
def test_the_wheel_runs_a_campaign_in_an_empty_folder(site, workflow, tmp_path):
    campaign = workflow.tiny_campaign()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    ran = subprocess.run(
        [
            *(sys.executable, "-m", "vinesexp.cli", "run", str(campaign)),
            *("--cores", "2", "--config", "results=out"),
        ],
        cwd=elsewhere,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    assert (elsewhere / "out/report.html").is_file()
    assert "] report" in ran.stderr, "the console is ours"
    again = subprocess.run(
        [*(sys.executable, "-m", "vinesexp.cli", "run", str(campaign)), "-n", "-C", "results=out"],
        cwd=elsewhere,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Nothing to be done" in again.stdout + again.stderr


def test_options_go_on_to_snakemake():
    home = workflow_home()
    command = snakemake_command(Path("a"), ["-n", "--config", "results=x", "--cores", "3"])
    assert command[3:6] == ["--config", 'campaign= "a" ', "results=x"]
    assert command[-3:] == ["-n", "--cores", "3"]
    asked = snakemake_command(Path("a"), ["results/a/impacts/b.csv", "--cores", "3"])
    assert asked[asked.index("results/a/impacts/b.csv") - 2] == "--workflow-profile"
    assert command[command.index("--workflow-profile") + 1] == str(home / "profiles/default")
    for words in (["--workflow-profile", "slurm"], ["--workflow-profile=slurm"]):
        assert snakemake_command(Path("a"), words)[-1].endswith(str(home / "profiles/slurm"))
    moved = snakemake_command(Path("a"), ["--directory", "elsewhere"])
    assert f'campaign= "{Path("a").resolve()}" ' in moved


@pytest.mark.parametrize("name", ["#3", "007", "1e3", "a #1: b", "[x]", "it's", "Prüfstand 50%"])
def test_a_folder_may_have_any_name(name):
    from snakemake.cli import parse_config

    command = snakemake_command(Path(name), [])
    (entry,) = (word for word in command if word.startswith("campaign="))
    assert parse_config([entry]) == {"campaign": name}


@pytest.mark.parametrize(
    ("options", "message"),
    [(["--config", "campaign=b"], "given already"), (["-s", "Snakefile"], "its own Snakefile")],
)
def test_a_second_campaign_or_snakefile_is_refused(options, message):
    with pytest.raises(ParameterError, match=message):
        snakemake_command(Path("a"), options)


def test_a_mistake_in_the_description_is_one_line(tmp_path, capsys):
    assert main(["run", str(tmp_path / "nothing"), "-n"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("vinesexp run: ")
    assert "no such folder" in line


def test_the_version_is_stated():
    assert vinesexp.__version__[0].isdigit()
