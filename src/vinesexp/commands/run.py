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
    own, rest = _own(options)
    config = [entry for entry in own.config if "=" in entry]
    asked = [word for word in own.config if "=" not in word]  # files, behind the entries
    if own.snakefile is not None:
        raise ParameterError("vinesexp brings its own Snakefile; leave out --snakefile")
    for entry in config:
        if entry.partition("=")[0] == "campaign":
            raise ParameterError(
                "the campaign is given already, as the first word", where=f"--config {entry}"
            )
    place = own.directory
    if place is None and not is_writable(Path.cwd()):
        config, place = _elsewhere(config)
    folder = campaign if place is None else campaign.resolve()
    home = workflow_home()
    # Entries of --config end with the next option: a file that is asked for must not follow them.
    command = [sys.executable, "-m", "snakemake", "--config", _entry("campaign", folder), *config]
    command += ["--snakefile", str(home / "workflow/Snakefile")]
    profile = home / "profiles" / own.workflow_profile  # one of ours by its name, as in a clone
    command += ["--workflow-profile", str(profile) if profile.is_dir() else own.workflow_profile]
    if place is not None:
        command += ["--directory", place]
    return [*command, *asked, *rest]


def _own(options: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
    """Options of Snakemake that have a meaning here too, and all the others as they are.

    Entries of every --config are taken together: Snakemake heeds only the last one.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--config", "-C", nargs="*", action="extend", default=[])
    parser.add_argument("--snakefile", "-s")
    parser.add_argument("--directory", "-d")
    parser.add_argument("--workflow-profile", default="default")
    return parser.parse_known_args(options)


def _entry(key: str, folder: Path) -> str:
    """An entry of --config as Snakemake reads it back whatever the folder is called.

    It strips quotes at either end and takes the rest as a number or as YAML: ``007`` is 7, and
    ``#3`` a remark. Quotes between blanks stay, and are a text to YAML.
    """
    return f"{key}= {json.dumps(str(folder))} "


def _elsewhere(config: Sequence[str]) -> tuple[list[str], str]:
    """Config and directory of a run from a folder that cannot be written.

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
    return [*others, _entry("results", results)], str(place)


def workflow_home() -> Path:
    """The folder that holds `workflow` and `profiles`: in the installed package, or the clone."""
    for home in (_PACKAGE / "installed", _PACKAGE.parents[1]):
        if (home / "workflow/Snakefile").is_file():
            return home
    raise VinesexpError("the workflow is missing from this installation; install vinesexp again")
