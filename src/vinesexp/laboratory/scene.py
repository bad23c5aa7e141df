"""A scene: scene.yaml to instrument files and their truth, group by group.

A group of tests is the unit of work: it is simulated by one job, and depends on nothing but
what `group_text` says. Truth goes to its own folder, which no step of the analysis reads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from vinesexp.errors import CampaignError, VinesexpError, nearest
from vinesexp.laboratory.bench import Scene, Test

__all__ = [
    "Scene",
    "Test",
    "group_files",
    "group_text",
    "load_scene",
    "raw_file",
    "simulate_group",
    "truth_file",
]


def load_scene(path: Path) -> Scene:
    """Understand scene.yaml (docs/scenes.md), or say in one line what is wrong with it.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Scene
        Everything in SI.

    Raises
    ------
    CampaignError
        The first mistake with line and key, and how many more there are.
    """
    from vinesexp.laboratory.scene_file import read_scene
    from vinesexp.records.problems import Problems

    problems = Problems(Path(path))
    scene = read_scene(Path(path), problems)
    found = list({str(problem): problem for problem in problems.found}.values())
    if found or scene is None:
        first: VinesexpError = found[0]
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise CampaignError(first.problem + more, file=first.file, where=first.where)
    return scene


def raw_file(test: Test) -> Path:
    """Instrument file of a test, relative to the campaign folder."""
    from vinesexp.laboratory.instrument_files import FORMATS

    return Path("raw") / f"{test.record}{FORMATS[test.oscilloscope.format][0]}"


def truth_file(test: Test) -> Path:
    """True impacts of a test, relative to the campaign folder."""
    return Path("truth") / f"{test.record}.csv"


def group_files(scene: Scene, group: str) -> list[Path]:
    """Raw files that a group writes, relative to the campaign folder."""
    return [raw_file(test) for test in _tests(scene, group)]


def group_text(scene: Scene, group: str) -> str:
    """All that the files of a group depend on, as one text: rig, seed, tests with their sensors."""
    tests = tuple(replace(test, note="") for test in _tests(scene, group))
    return repr((scene.seed, scene.oscillator, scene.damping, scene.balls, scene.sheet, tests))


def simulate_group(
    scene: Scene, group: str, folder: Path, *, progress: Callable[[], None] | None = None
) -> list[Path]:
    """Simulate the tests of a group and write their raw files and truth.

    Parameters
    ----------
    scene : Scene
    group : str
        One of `Scene.groups`.
    folder : Path
        The campaign folder; `raw` and `truth` are made in it.
    progress : callable, optional
        Called after each test.

    Returns
    -------
    list of Path
        The raw files.

    Raises
    ------
    CampaignError
        No such group.
    """
    from vinesexp.laboratory.experiment import perform

    for name in ("raw", "truth"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for test in _tests(scene, group):
        perform(scene, test, raw=folder / raw_file(test), truth=folder / truth_file(test))
        if progress is not None:
            progress()
    return [folder / path for path in group_files(scene, group)]


def _tests(scene: Scene, group: str) -> tuple[Test, ...]:
    if group not in scene.groups:
        raise CampaignError(f"no group '{group}' in the scene; {nearest(group, scene.groups)}")
    return scene.groups[group]
