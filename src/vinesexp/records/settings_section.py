"""The part of campaign.yaml that changes numbers which steer the stages."""

from __future__ import annotations

from vinesexp.errors import nearest
from vinesexp.records.problems import Problems
from vinesexp.records.yamltree import Section
from vinesexp.settings.overrides import STAGES, changed
from vinesexp.settings.stages import Settings


def read_settings(top: Section, problems: Problems) -> Settings:
    """Settings of a campaign: under `settings` a section a stage, each number by its name."""
    found = Settings()
    section = top.values.get("settings")
    if section is None:
        return found
    if not isinstance(section, Section):
        problems.add(_not_a_section(section), where=top.where("settings"))
        return found
    for stage, numbers in section.values.items():
        if stage not in STAGES:
            problems.add(
                f"unknown stage '{stage}'; {nearest(stage, STAGES)}", where=section.where(stage)
            )
        elif isinstance(numbers, Section):
            for name, text in numbers.values.items():
                with problems.at(numbers.where(name)):
                    found = changed(found, stage, name, text)
        elif numbers is not None:
            problems.add(_not_a_section(numbers), where=section.where(stage))
    return found


def _not_a_section(value: object) -> str:
    return f"found '{value}', expected 'name: value' pairs; docs/settings.md lists them"
