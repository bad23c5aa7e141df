"""`vinesexp run`: the workflow on a campaign, from an installed package or from a clone.

The same Snakefile and profile as `snakemake` in a clone; the wheel carries them. Everything after
the campaign goes to Snakemake as it is.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from vinesexp.environment import is_writable, own_folder
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.records.campaign.load import load_campaign

_PACKAGE = Path(__file__).resolve().parents[1]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The campaign folder, and options of Snakemake."""
    parser.usage = "vinesexp run CAMPAIGN [snakemake options]"
    parser.add_argument(
        "path", type=Path, metavar="CAMPAIGN", help="folder of campaign.yaml and records.csv"
    )
    parser.add_argument(
        "options",
        nargs=argparse.REMAINDER,
        metavar="...",
        help="for Snakemake, such as -n (what would run), --cores 4, --config results=DIR, "
        "--workflow-profile slurm",
    )


def run(args: argparse.Namespace) -> int:
    """Run Snakemake in this folder; its exit code is that of the command."""
    load_campaign(args.path)  # a mistake in the description is said at once
    command = snakemake_command(args.path, args.options)
    with subprocess.Popen(command) as process:
        while True:
            try:
                return process.wait()
            except KeyboardInterrupt:
                continue  # Snakemake has it too: it ends its jobs, and then itself


def snakemake_command(campaign: Path, options: Sequence[str]) -> list[str]:
    """The command line of Snakemake for a campaign.

    Raises
    ------
    ParameterError
        A second campaign, or a second Snakefile, among the options.

    Examples
    --------
    >>> command = snakemake_command(Path("mytests"), ["-n", "--config", "results=out"])
    >>> command[command.index("--config") + 1 : command.index("--snakefile")]
    ['campaign= "mytests" ', 'results=out']
    """
    rest, config = _without_config(options)
    for option in rest:
        if option.partition("=")[0] in ("-s", "--snakefile"):
            raise ParameterError("vinesexp brings its own Snakefile; leave this out", where=option)
    for entry in config:
        if entry.partition("=")[0] == "campaign":
            raise ParameterError(
                "the campaign is given already, as the first word", where=f"--config {entry}"
            )
    moved = any(o.partition("=")[0] in ("-d", "--directory") for o in rest)
    if not moved and not is_writable(Path.cwd()):
        config, rest, moved = *_elsewhere(config, rest), True
    folder = campaign.resolve() if moved else campaign
    home = workflow_home()
    # Entries of --config end with the next option: a file that is asked for must not follow them.
    command = [sys.executable, "-m", "snakemake", "--config", _entry("campaign", folder), *config]
    command += ["--snakefile", str(home / "workflow/Snakefile")]
    if not any(o.partition("=")[0] == "--workflow-profile" for o in rest):
        command += ["--workflow-profile", str(home / "profiles/default")]
    return [*command, *_own_profile(rest, home)]


def _entry(key: str, folder: Path) -> str:
    """An entry of --config as Snakemake reads it back whatever the folder is called.

    It strips quotes at either end and takes the rest as a number or as YAML: ``007`` is 7, and
    ``#3`` a remark. Quotes between blanks stay, and are a text to YAML.
    """
    return f"{key}= {json.dumps(str(folder))} "


def _elsewhere(config: Sequence[str], rest: Sequence[str]) -> tuple[list[str], list[str]]:
    """Config and options of a run from a folder that cannot be written.

    What Snakemake notes of a run goes to a folder of its own, one for each results folder.
    """
    given = [entry for entry in config if entry.partition("=")[0] == "results"]
    if not given:
        raise ParameterError(
            "cannot be written; name a folder for the results with --config results=DIR",
            where=str(Path.cwd()),
        )
    results = Path(given[-1].partition("=")[2]).resolve()
    place = own_folder() / f"run-{sha256(str(results).encode()).hexdigest()[:16]}"
    place.mkdir(exist_ok=True)
    others = [entry for entry in config if entry not in given]
    return [*others, _entry("results", results)], [*rest, "--directory", str(place)]


def workflow_home() -> Path:
    """The folder that holds `workflow` and `profiles`: in the installed package, or the clone."""
    for home in (_PACKAGE / "installed", _PACKAGE.parents[1]):
        if (home / "workflow/Snakefile").is_file():
            return home
    raise VinesexpError("the workflow is missing from this installation; install vinesexp again")


def _without_config(options: Sequence[str]) -> tuple[list[str], list[str]]:
    """The options without --config, and its entries: Snakemake heeds only the last --config."""
    rest: list[str] = []
    config: list[str] = []
    inside = False
    for word in options:
        if word in ("--config", "-C"):
            inside = True
        elif word.startswith("--config="):
            config.append(word.partition("=")[2])
        elif inside and not word.startswith("-") and "=" in word:
            config.append(word)
        else:
            inside = False
            rest.append(word)
    return rest, config


def _own_profile(options: Sequence[str], home: Path) -> list[str]:
    """A profile of ours by its name alone, as in a clone: ``--workflow-profile slurm``."""
    found = []
    follows = False
    for word in options:
        key, equals, name = word.partition("=")
        if follows and (home / "profiles" / word / "profile.yaml").is_file():
            word = str(home / "profiles" / word)
        elif key == "--workflow-profile" and equals and (home / "profiles" / name).is_dir():
            word = f"{key}={home / 'profiles' / name}"
        follows = word == "--workflow-profile"
        found.append(word)
    return found
