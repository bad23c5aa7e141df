"""What the page of records does with packed numbers, in Python."""

import base64
import zlib

import numpy as np

GAP = -32768


def unpacked(content):
    """What `packed` packed."""
    steps = np.frombuffer(base64.b64decode(content["int16"]), "<i2").astype(np.float64)
    steps[steps == GAP] = np.nan
    return content["offset"] + content["scale"] * steps


def unsqueezed(content):
    """What `squeezed` made small."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(content["deflated"])), np.uint8)
    half = planes.size // 2
    folded = planes[:half].astype(np.int32) | planes[half:].astype(np.int32) << 8
    steps = ((folded >> 1) ^ -(folded & 1)).astype(np.int16)
    for _ in range(content["order"]):
        steps = np.cumsum(steps, dtype=np.int16)
    values = content["offset"] + content["scale"] * steps.astype(np.float64)
    values[steps == GAP] = np.nan
    return values
