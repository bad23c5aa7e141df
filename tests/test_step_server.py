"""Steps on records from a process that has everything loaded: the same, and never depended on."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from vinesexp import step_client, step_server

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks on Linux only")

CLIENT = [sys.executable, "-I", "-S", step_client.__file__]


@pytest.fixture
def server(monkeypatch):
    """A server of this process; its place."""
    monkeypatch.delenv(step_client.SOCKET, raising=False)
    ends = []
    monkeypatch.setattr(step_server.atexit, "register", lambda *end: ends.append(end))
    step_server.start_server()
    yield os.environ[step_client.SOCKET]
    for function, *arguments in ends:
        function(*arguments)
    assert step_client.SOCKET not in os.environ


def job(folder: Path, *, campaign: str) -> str:
    """A step that fails, since there is no such campaign."""
    about = {"campaign": campaign, "results": "results", "made": "m.json", "used": {}, "reads": []}
    return json.dumps(
        {
            "step": "condition",
            "record": "a",
            "about": about,
            "read": [],
            "written": [],
            "log": str(folder / "a.log"),
        }
    )


def done(text: str, folder: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        [*CLIENT, text], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )


def test_a_step_fails_in_the_same_words_with_and_without_a_server(server, tmp_path, monkeypatch):
    text = job(tmp_path, campaign="nowhere")
    served = done(text, tmp_path)
    assert served.returncode == 1
    assert served.stderr.startswith("vinesexp: nowhere")
    assert "Traceback" not in served.stderr
    monkeypatch.delenv(step_client.SOCKET)
    alone = done(text, tmp_path)
    assert (alone.returncode, alone.stderr) == (served.returncode, served.stderr)


def test_steps_go_on_without_a_server_that_was_killed(server, tmp_path):
    for process in servers():
        process.kill()
        process.wait()
    assert "nowhere" in done(job(tmp_path, campaign="nowhere"), tmp_path).stderr


def test_a_job_that_is_no_job_ends_with_an_error_and_the_next_one_is_done(server, tmp_path):
    assert done("no job", tmp_path).returncode == 1
    assert "nowhere" in done(job(tmp_path, campaign="nowhere"), tmp_path).stderr


def test_a_step_ends_with_its_client(server, tmp_path):
    os.mkfifo(tmp_path / "a.log")  # nobody reads it: the step waits for ever
    client = subprocess.Popen([*CLIENT, job(tmp_path, campaign="nowhere")], cwd=tmp_path)
    step = the_only(forks, seconds=20)
    client.kill()
    client.wait()
    _, alive = psutil.wait_procs([step], timeout=20)
    assert not [process for process in alive if process.status() != psutil.STATUS_ZOMBIE]


def test_a_place_too_deep_for_a_socket_leaves_steps_to_themselves(tmp_path, monkeypatch):
    deep = tmp_path / ("d" * 100)
    deep.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(deep))
    monkeypatch.delenv(step_client.SOCKET, raising=False)
    step_server.start_server()
    assert step_client.SOCKET not in os.environ
    assert not list(deep.iterdir())
    assert "nowhere" in done(job(tmp_path, campaign="nowhere"), tmp_path).stderr


def forks() -> list[psutil.Process]:
    """Steps under way."""
    found = [step for server in servers() for step in server.children()]
    return [step for step in found if not any("fork_server" in word for word in step.cmdline())]


def servers() -> list[psutil.Process]:
    children = psutil.Process().children()
    return [child for child in children if "vinesexp.step_server" in child.cmdline()]


def the_only(find, *, seconds: float) -> psutil.Process:
    for _ in range(int(20 * seconds)):
        found = find()
        if found:
            return found[0]
        time.sleep(0.05)
    raise AssertionError("no such process")
