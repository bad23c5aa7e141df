"""What the Snakefile asks of a run: campaign, results, what is kept, how messages are written."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vinesexp.errors import VinesexpError, nearest
from vinesexp.records.result_paths import ResultPaths
from vinesexp.resultslock import require_own_folder

#: Keys of `--config`.
CONFIG = ("campaign", "results", "keep")


def read_config(config: Mapping[str, Any]) -> tuple[Path, ResultPaths]:
    """Campaign folder and results folder of a run.

    Raises
    ------
    VinesexpError
        An unknown key, with the nearest known one; a value that is no folder's name; a folder that
        holds other things than results.

    Examples
    --------
    >>> folder, paths = read_config({"campaign": "data/twin"})
    >>> folder.as_posix(), paths.folder.as_posix()
    ('data/twin', 'results/twin')
    """
    for key in config:
        if key not in CONFIG:
            raise VinesexpError(f"--config {key}=...: unknown key '{key}'; {nearest(key, CONFIG)}")
    campaign = _folder(config, "campaign", "data/twin")
    results = _folder(config, "results", str(Path("results") / campaign.resolve().name))
    if "{" in str(results) or "}" in str(results):
        raise VinesexpError(
            "the name of a results folder cannot hold { or }; choose another with "
            "--config results=DIR",
            file=results,
        )
    if results.resolve() == campaign.resolve():
        raise VinesexpError(
            "the results cannot go into the campaign's own folder, among what was measured; choose "
            "another with --config results=DIR",
            file=results,
        )
    require_own_folder(results)
    return campaign, ResultPaths(results)


def keeps_channels(config: Mapping[str, Any]) -> bool:
    """Whether the channels of every record stay after a run; not with ``--config keep=final``.

    Raises
    ------
    VinesexpError
        Another word than ``final`` or ``all``.

    Examples
    --------
    >>> keeps_channels({}), keeps_channels({"keep": "final"})
    (True, False)
    """
    word = config.get("keep", "all")
    if word not in ("all", "final"):
        raise VinesexpError(
            f"--config keep=...: found '{word}'; final removes the channels of each record when "
            "the report is made, all keeps them"
        )
    return bool(word == "all")


def _folder(config: Mapping[str, Any], key: str, default: str) -> Path:
    value = config.get(key)
    if value is None:
        return Path(default)
    # Snakemake reads what looks like a number as one: 2024 is safe, 007 and 1e3 are not.
    if not isinstance(value, str) and not (
        type(value) is int and (key == "results" or Path(str(value)).is_dir())
    ):
        raise VinesexpError(
            f"--config {key}=...: Snakemake read {value!r}; write the folder as a path, such as "
            f"{key}=./{value}"
        )
    return Path(str(value))


def shown(path: Path) -> str:
    """A path in a message of a rule, where Snakemake takes braces for wildcards."""
    return str(path).replace("{", "{{").replace("}", "}}")


def accept_own_environment(workflow: Any) -> None:
    """Have `snakemake --lint` accept that the steps name no conda environment and no container.

    The software of every step is this package, in whose environment Snakemake itself runs and
    whose versions requirements.lock holds; a second description of it could only disagree. Rules
    of other Snakefiles, which may use this one as a module, are looked at as ever.
    """
    if "--lint" not in sys.argv:
        return
    from snakemake.linting.rules import RuleLinter

    own = str(workflow.current_basedir.get_path_or_uri(secret_free=True))
    ask = RuleLinter.lint_missing_software_definition
    RuleLinter.lint_missing_software_definition = lambda linter, rule: (
        () if str(rule.snakefile).startswith(own) else ask(linter, rule)
    )
