"""`vinesexp simulate SCENE OUT`: a whole campaign folder from a scene, ready for `snakemake`."""

from __future__ import annotations

import argparse
import shutil
import time
from pathlib import Path

from vinesexp.commands.options import Bar, add_options
from vinesexp.errors import CampaignError, VinesexpError, nearest, say


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Scene, folder, and which groups."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="scene.yaml")
    parser.add_argument("out", type=Path, metavar="OUT", help="campaign folder to write")
    group = ("--group NAME", "only this group of tests (may be repeated); default: all")
    add_options(parser, group, action="append")
    add_options(parser, ("--force", "overwrite existing instrument files"))


def run(args: argparse.Namespace) -> int:
    """Write raw/, truth/ and, where they are missing, scene.yaml, campaign.yaml, records.csv."""
    from vinesexp.laboratory.scene import load_scene, raw_file
    from vinesexp.laboratory.simulated_files import refuse_measured, simulate_once

    scene = load_scene(args.scene)
    groups = args.group or list(scene.groups)
    for group in (group for group in groups if group not in scene.groups):
        raise CampaignError(f"no group '{group}'; {nearest(group, scene.groups)}", file=args.scene)
    if not args.force:
        refuse_measured(args.out)
    write_description(args.scene, args.out)
    tests = [test for group in groups for test in scene.groups[group]]
    seconds = sum(test.settle + test.duration for test in tests)
    say(f"{len(tests)} records, {seconds:,.0f} s of motion")
    for group in groups:
        started, made = time.perf_counter(), []
        bar = Bar(f"records of {group}")
        try:
            for number, test in enumerate(scene.groups[group], 1):
                if simulate_once(scene, test, args.out, force=args.force):
                    made.append(args.out / raw_file(test))
                bar(number, len(scene.groups[group]))
            bar.end()
        except KeyboardInterrupt:
            say(
                f"vinesexp simulate: stopped in {group}; the records before are complete, and "
                "the same command continues with the next"
            )
            return 130
        if not made:
            print(f"{group:20} is there already, from this scene", flush=True)
            continue
        megabytes = sum(path.stat().st_size for path in made) / 1e6
        size, took = f"{megabytes:8.1f} MB", f"{time.perf_counter() - started:6.2f} s"
        print(f"{group:20} {f'{len(made)} records':>11} {size} {took}", flush=True)
    return 0


def write_description(scene_file: Path, out: Path) -> None:
    """scene.yaml with its base records, campaign.yaml and records.csv in `out`.

    What a person wrote there stays.

    Raises
    ------
    VinesexpError
        The folder holds another scene: its records would be mixed with these.
    """
    from vinesexp.laboratory.scene import load_scene
    from vinesexp.laboratory.simulated_files import campaign_text, records_text

    scene = load_scene(scene_file)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise VinesexpError(
            f"cannot be made a folder ({error.strerror}); name another", file=out
        ) from None
    texts = {
        "scene.yaml": scene_file.read_text(encoding="utf-8-sig"),
        "campaign.yaml": campaign_text(scene),
        "records.csv": records_text(scene),
    }
    own = out / "scene.yaml"
    if own.exists() and own.read_text(encoding="utf-8-sig") != texts["scene.yaml"]:
        raise VinesexpError(
            f"differs from {scene_file}; name an empty folder, or remove it", file=own
        )
    for file in scene.measured:
        _bring(scene_file.parent / file, out / file)
    for name, text in texts.items():
        if not (out / name).exists():
            (out / name).write_text(text, encoding="utf-8", newline="\n")


def _bring(source: Path, target: Path) -> None:
    """A measured base motion goes with its scene, so that the folder stands alone."""
    if target.exists() and target.read_bytes() == source.read_bytes():
        return
    if target.exists():
        raise VinesexpError(f"differs from {source}; name an empty folder", file=target)
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
