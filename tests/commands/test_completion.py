"""`vinesexp completion`: the scripts name every command, and bash completes with them."""

import shutil
import subprocess

import pytest

from vinesexp.cli import COMMANDS, main


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_command_is_in_the_script_and_the_shell_reads_it(shell, capsys, tmp_path):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in COMMANDS)
    assert "acceleration-unit" in script
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    path = tmp_path / "script"
    path.write_text(script)
    check = subprocess.run([shell, "-n", str(path)], capture_output=True, text=True, check=False)
    assert (check.returncode, check.stderr) == (0, "")


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("vinesexp che", ["check"]),
        ("vinesexp impacts --acc", ["--acceleration", "--acceleration-unit"]),
        ("vinesexp look rec", ["record one.csv"]),
    ],
)
def test_bash_completes_commands_options_and_files(line, expected, capsys, tmp_path):
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    (tmp_path / "record one.csv").write_text("")
    words = line.split(" ")
    ask = (
        f"{script}\nCOMP_WORDS=({' '.join(words)})\nCOMP_CWORD={len(words) - 1}\n"
        "_shtab_vinesexp\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n"
    )
    done = subprocess.run(
        ["bash", "-c", ask], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout.splitlines() == expected
