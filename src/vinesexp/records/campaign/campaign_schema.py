"""The JSON schema of campaign.yaml, made from the names that its validation knows.

Editors that know JSON schemas complete and check the file with it; the package's own validation is
stricter (units, columns, values that contradict one another).
"""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from vinesexp.records.campaign.channel_section import CHANNEL_KEYS, SETUP_KEYS, SOUND_KEYS
from vinesexp.records.campaign.description import BAND_KEYS, KEYS, KNOWN_KEYS, PEOPLE_KEYS
from vinesexp.records.campaign.schema import ACCEPTABLE, ROLES
from vinesexp.records.campaign.uncertainties import Uncertainties
from vinesexp.settings.overrides import STAGES, numbers_of

NAME = "campaign.schema.json"

_TEXT: dict[str, Any] = {"type": ["string", "number"]}
_ANSWER: dict[str, Any] = {"enum": ["yes", "no", True, False]}
_COLUMN: dict[str, Any] = {
    "type": ["string", "integer"],
    "description": "name, pattern such as Laser*, or number from 0",
}
_CHANNEL: dict[str, dict[str, Any]] = {
    "column": _COLUMN,
    "unit": {"type": "string", "description": "the file is in this unit"},
    "radius": {
        **_TEXT,
        "description": "of an angle or its rate: the distance from the axis, 0.5 m",
    },
    "sensitivity": {"type": "string", "description": "output per measured unit: 100 mV/g"},
    "offset": {**_TEXT, "description": "output at zero: 2.5 V"},
    "file_unit": {"type": "string", "description": "what one number of the file is: mV"},
    "optional": _ANSWER,
    "accept": {"description": "defects that are warnings: " + ", ".join(ACCEPTABLE)},
}


def campaign_schema() -> dict[str, Any]:
    """The schema as a dictionary (JSON schema, draft 7)."""
    parts: dict[str, dict[str, Any]] = {
        "known": _section({key: {} for key in KNOWN_KEYS}),
        "channels": _channels(),
        "time": _time(),
        "sample_rate": {"type": "string", "description": "10 kHz; not together with time"},
        "bandpass": _section({key: {"type": "string"} for key in BAND_KEYS}),
        "settings": _section(
            {s: _section({n.name: {} for n in numbers_of(s)}) for s in STAGES}, nullable=True
        ),
        "uncertainties": _section({one.name: {} for one in fields(Uncertainties)}),
        "allow_outside": _ANSWER,
        "setups": {
            "type": "object",
            "additionalProperties": _section({key: _setup_part(key) for key in SETUP_KEYS}),
        },
    }
    properties = {key: parts.get(key, _TEXT) for key in (*KEYS, *PEOPLE_KEYS)}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "campaign.yaml of vinesexp",
        **_section(properties),
        "required": ["channels"],
    }


def schema_text() -> str:
    """The schema as JSON text.

    Examples
    --------
    >>> '"displacement"' in schema_text()
    True
    """
    return json.dumps(campaign_schema(), indent=1, sort_keys=True) + "\n"


def _section(properties: dict[str, Any], *, nullable: bool = False) -> dict[str, Any]:
    kind: Any = ["object", "null"] if nullable else "object"
    return {"type": kind, "properties": properties, "additionalProperties": False}


def _channels() -> dict[str, Any]:
    found = {}
    for role, quantities in ROLES.items():
        if role == "sound":
            keys = {key: _CHANNEL.get(key, {}) for key in SOUND_KEYS}
            found[role] = {**_section(keys), "required": ["column"]}
            continue
        keys = {key: _CHANNEL.get(key, {}) for key in CHANNEL_KEYS}
        keys["quantity"] = {"enum": list(quantities)}
        found[role] = {**_section(keys), "required": ["column", "quantity"]}
        found[role]["oneOf"] = [{"required": ["unit"]}, {"required": ["sensitivity"]}]
    return _section(found)


def _time() -> dict[str, Any]:
    return {**_section({"column": _COLUMN, "unit": {"type": "string"}}), "required": ["unit"]}


def _setup_part(key: str) -> dict[str, Any]:
    return {"channels": _channels(), "time": _time()}.get(key, {"type": "string"})
