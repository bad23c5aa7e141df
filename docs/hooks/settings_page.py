"""docs/settings.md: every setting with unit, default, limits, reason and where it is measured.

python docs/hooks/settings_page.py > docs/settings.md
"""

from __future__ import annotations

from dataclasses import Field
from typing import Any

from vinesexp.settings.stages import STAGES, Settings, numbers_of, written
from vinesexp.units import UNITS

_HEAD = """# Settings

These numbers control the analysis. None has to be set: thresholds follow the noise of a record, and
the template of a contact is learnt from it. To change one for a whole campaign, write it under
`settings` in campaign.yaml, with one section per stage:

```yaml
settings:
  impacts: {threshold: 7, apart: 2 ms}
  regimes: {settling: 0.1}
```

To change one for a single record, write it in the column `settings` of records.csv; separate
several by `|`: `impacts.threshold = 7 | regimes.settling = 0.1`. A setting of the record replaces
that of the campaign. Numbers with a dimension have a unit. The report lists changed settings. This
page is made by
`python docs/hooks/settings_page.py`.
"""


def settings_page() -> str:
    """The text of docs/settings.md."""
    lines = [_HEAD]
    for stage in STAGES:
        lines += [f"## {stage}", "", f"{type(getattr(Settings(), stage)).__doc__}", ""]
        lines += ["| setting | default | limits | what it does, and why | measured in |"]
        lines += ["|---|---|---|---|---|"]
        lines += [_row(setting) for setting in numbers_of(stage)]
        lines += [""]
    return "\n".join(lines)


def _row(setting: Field[Any]) -> str:
    meta = setting.metadata
    of = meta["of"]
    counted = (
        f" ({of})" if of and of not in UNITS and isinstance(setting.default, int | float) else ""
    )
    if isinstance(setting.default, bool):
        limits, counted = "yes or no", ""
    elif isinstance(setting.default, str):
        limits = ", ".join(f"`{word}`" for word in meta["words"])
    else:
        limits = f"{written(setting, meta['low'])} to {written(setting, meta['high'])}"
    default = written(setting, setting.default)
    return (
        f"| `{setting.name}` | {default}{counted} | {limits} | {meta['why']} | {meta['measured']} |"
    )


if __name__ == "__main__":
    print(settings_page(), end="")
