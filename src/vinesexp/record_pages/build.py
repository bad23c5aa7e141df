"""records.html, a page that shows any record, and beside it a folder with one file a record.

The page is one file and its library stands once beside it; what it shows of a record is loaded
when the record is shown. Both work from disk: no server, no network (docs/report.md).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.figures.invariant_manifold import on_manifold, sim_parts
from vinesexp.figures.numbers import plus_minus, significant
from vinesexp.figures.record_words import clearance_of, regime_words, settings_of
from vinesexp.figures.style import COLOURS
from vinesexp.identification.estimate import Estimate, read_estimates
from vinesexp.record_pages.traces import lengths_over_time, packed, samples_of, script, traces_of
from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.freshness import Notes
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import open_record
from vinesexp.records.stored.tables import Row
from vinesexp.report.page import SEVERITY, band_kept
from vinesexp.report.rendering import rendered
from vinesexp.results import CampaignResults
from vinesexp.theory.manifold import C_1, C_2, amplitude
from vinesexp.whole_files import write_whole

# What the page of one record says: its settings, regime, estimates, checks, replay, provenance.
#: Parameter of an estimate to what it is; others serve later steps and are not shown.
_WORDS = {
    "f0": "natural frequency f0",
    "zeta": "damping ratio ζ",
    "f0_added": "natural frequency with the added mass",
    "zeta_added": "damping ratio with the added mass",
    "M": "mass of the oscillator M",
    "r": "restitution r",
    "r_scatter": "scatter of r from impact to impact",
    "working_amplitude": "amplitude of the mass",
    "accelerometer_gain": "accelerometer over displacement channel",
    "channel_lag": "delay of the acceleration behind the displacement, from all frequencies",
    "phase_lag": "the same delay, from the phase at the oscillation alone",
    "accelerometer_corner": "highpass corner of the accelerometer (AC coupling; 0: none)",
    "base_gain": "base channel over what moves the mass",
    "base_lag": "lag of the base channel",
    "damping_quadratic": "damping in proportion to amplitude",
    "damping_coulomb": "dry friction",
    "stiffening": "stiffening",
    "frequency_slope": "change of f0 with amplitude",
    "frequency_inverse": "change of f0 with one over amplitude",
    "f0_drift": "change of f0 with time over the record",
}
_BALL = re.compile(r"^(r)_(\d+)(.*)$")


def estimate_rows(found: Iterable[Estimate], contradicted: str = "") -> list[list[str]]:
    """Rows of the page: what it is, method, value with the error of the record's noise, note.

    Parameters
    ----------
    found : iterable of Estimate
    contradicted : str
        Stated clearance that the records contradict, with which r and M of this record were
        computed; empty where there is none.

    Examples
    --------
    >>> one = Estimate("r_2", 0.6, 0.001, "1", "impacts", ("a",))
    >>> estimate_rows([one, Estimate("misfit", 0.1, 0.0, "1", "likelihood", ("a",))])
    [['restitution r of ball 2', 'impacts', '0.6000 ± 0.0020', '']]
    >>> estimate_rows([one], "38.5")[0][2:]
    ['–', 'not usable: the records contradict the stated clearance of 38.5 mm']
    """
    rows = []
    for one in found:
        words = _words(one.parameter)
        if not words or not np.isfinite(one.value):
            continue
        size, unit = (1e3, "mm") if one.unit == "m" else (1.0, one.unit)
        value, at = plus_minus(size * one.value, size * one.std_error, unit), ""
        if one.amplitude and one.parameter.startswith(("f0", "zeta")):  # where they hold
            at = f"at {1e3 * one.amplitude:.3g} mm"
        note = "; ".join(filter(None, (at, one.note)))
        if contradicted and one.parameter.startswith(("r", "M")) and one.method == "impacts":
            value = "–"
            note = f"not usable: the records contradict the stated clearance of {contradicted} mm"
        rows.append([words, one.method, value, note])
    return rows


def _words(parameter: str) -> str:
    of_one, ball = _BALL.sub(r"\1\3", parameter), _BALL.match(parameter)
    words = _WORDS.get(of_one, "")
    return f"{words} of ball {ball[2]}" if words and ball else words


#: Points on the manifold that are drawn.
_MOST_POINTS = 3000
_HIGHEST = 1.5  # amplitude up to which it is drawn, clearances

#: Attributes of a measured record that are no bookkeeping, as its page names them.
_ATTRIBUTES = {
    "source": "instrument file",
    "source_sha256": "SHA-256 of it",
    "setup": "setup",
    "note": "note",
}


def facts_of(record: Record, results: CampaignResults) -> dict[str, Any]:
    """Tables and curves of one record that depend on the whole campaign.

    Returns
    -------
    dict
        Texts are finished; ready to be written as JSON.
    """
    paths, stated = ResultPaths(results.folder), results.campaign.record(record.id)
    checks, replay, cycles, regimes, transitions = (
        results.of_record(name, record.id)
        for name in ("checks", "replay", "replay_cycles", "regimes", "transitions")
    )
    return {
        "settings": [
            ["test", record.test],
            *([name, value] for name, value, _ in settings_of(record, stated)),
        ],
        "regime": regime_words(regimes[0] if regimes else {}, transitions),
        "checks": [
            [row["check"], row["outcome"], row["detail"].replace("+-", "±")] for row in checks
        ],
        "estimates": _estimates(record, stated, paths),
        "replay": [
            [row["quantity"], _value(row, "measured"), _value(row, "replayed"), row["outcome"]]
            for row in replay
        ],
        "replayed": lengths_over_time(
            cycles, median="replayed_m", low="replayed_low_m", high="replayed_high_m"
        ),
        "manifold": _manifold(record, paths, results.rig),
        "provenance": _provenance(record, paths),
    }


def _estimates(record: Record, stated: Record, paths: ResultPaths) -> list[list[str]]:
    path = paths.estimates(record.id)
    contradicted = "" if record.clearance == stated.clearance else clearance_of(stated)
    return estimate_rows(read_estimates(path), contradicted) if path.is_file() else []


def _value(row: Row, column: str) -> str:
    """A cell of replay.csv in the unit that is shown; texts as they are."""
    if row["quantity"] == "regime":
        return (row["starts"] or row["replayed"] if column == "replayed" else row[column]) or "–"
    millimetres = row["unit"] == "m"
    text = significant(row[column], factor=1e3 if millimetres else 1.0)
    unit = "mm" if millimetres else "" if row["unit"] == "1" else row["unit"]
    return f"{text} {unit}".strip()


def _manifold(record: Record, paths: ResultPaths, rig: IdentifiedRig) -> dict[str, Any] | None:
    """Ball and oscillator amplitude after each impact, in clearances; of one ball only."""
    known = {"M", "k1", "r", "m"} <= set(rig.values)
    if not known or len(record.clearance) != 1 or record.exclude or record.test == "drop":
        return None
    motion = on_manifold(record, paths.folder, rig)
    good = np.isfinite(motion.C) & np.isfinite(motion.A)
    if good.sum() < 5:
        return None
    step = max(-(-int(good.sum()) // _MOST_POINTS), 1)
    return {"C": packed(motion.C[good][::step]), "A": packed(motion.A[good][::step])}


def _provenance(record: Record, paths: ResultPaths) -> list[list[str]]:
    with open_record(paths.record(record.id)) as view:
        found = [
            [name, str(view.attributes[key]).replace(";", "; ")]
            for key, name in _ATTRIBUTES.items()
            if view.attributes.get(key)
        ]
        if view.n:
            found.append(["length", f"{view.n / view.sample_rate:.4g} s, {view.n} samples"])
            found.append(["sampling", f"{1e-3 * view.sample_rate:.4g} kHz"])
    with open_record(paths.conditioned(record.id)) as view:
        for role in view.roles:
            found.append([f"band of {role}, Hz", band_kept(view, role)])
    found += [[name, text] for name, text in record.people.items()]
    return found


def list_of_records(results: CampaignResults) -> list[list[Any]]:
    """Id, test, clearance, base amplitude, regime, impacts per cycle, mean and largest amplitude,
    outcome and the checks that warn; one list a record, in the order of records.csv."""
    found = []
    for record in results.as_found.records:
        row: Row = next(iter(results.of_record("regimes", record.id)), {})
        odd = [one for one in results.of_record("checks", record.id) if one["outcome"] != "ok"]
        outcome = min((c["outcome"] for c in odd), key=SEVERITY.__getitem__, default="ok")
        found.append(
            [
                record.id,
                record.test,
                clearance_of(record),
                f"{1e3 * record.base_amplitude:g}" if record.base_amplitude else "",
                row.get("regime", ""),
                _number(row.get("impacts_per_cycle")),
                _number(row.get("amplitude_mean_m"), 1e3),
                _number(row.get("amplitude_max_m"), 1e3),
                outcome,
                ", ".join(dict.fromkeys(check["check"] for check in odd)),
            ]
        )
    return found


def _number(value: float | None, factor: float = 1.0) -> str:
    return "" if value is None else significant(value, factor=factor)


def manifold_curve(rig: IdentifiedRig) -> dict[str, Any] | None:
    """The slow invariant manifold of the identified restitution, in clearances."""
    if "r" not in rig.values:
        return None
    r = rig.values["r"].value
    ends = {"T1": float(C_1(r)), "T2": float(C_2())}
    return {
        "r": r,
        **{name: [C, float(amplitude(C, r=r))] for name, C in ends.items()},
        "parts": [
            {"kind": kind, "C": np.round(C, 4).tolist(), "A": np.round(A, 5).tolist()}
            for kind, C, A in sim_parts(r, _HIGHEST)
        ],
    }


#: The plotting library, as its Python package carries it.
LIBRARY = ("bokeh.min.js", "bokeh-api.min.js")


def build_pages(campaign: Campaign, *, paths: ResultPaths, code: str) -> list[Path]:
    """Write records.html and what it loads; traces of unchanged records are left as they are.

    Parameters
    ----------
    campaign : Campaign
    paths : ResultPaths
    code : str
        Digest of the code, so that pages of an older version are made anew.

    Returns
    -------
    list of Path
        Every file besides records.html.
    """
    for part in ("library", "traces", "facts"):
        (paths.pages / part).mkdir(parents=True, exist_ok=True)
    written = [*_library(paths.pages / "library")]
    for record in campaign.records:
        written += _traces(campaign, record, paths=paths, code=code)
    written += _facts(campaign, paths)
    return written


def _library(folder: Path) -> Iterable[Path]:
    spec = find_spec("bokeh")
    home = Path((spec.submodule_search_locations or [""])[0] if spec else "")
    for name in LIBRARY:
        content = (home / "server" / "static" / "js" / name).read_bytes()
        if not (folder / name).is_file() or (folder / name).read_bytes() != content:
            write_whole(folder / name, content)
        yield folder / name


def _traces(campaign: Campaign, record: Record, *, paths: ResultPaths, code: str) -> list[Path]:
    """Write what is drawn of a record, unless what is there is still right: the overview first."""
    page = paths.pages / "traces" / f"{record.id}.js"
    samples = paths.pages / "samples" / record.id
    notes = Notes(
        paths.notes("traces", record.id), {"results": paths.folder, "campaign": campaign.folder}
    )
    used = {"code": code, "test": record.test, "balls": str(len(record.clearance))}
    sources = (paths.record, paths.conditioned, paths.impacts, paths.decay)
    reads = [source(record.id) for source in sources]
    if notes.why_outdated("traces", used, reads=reads):
        with notes.making("traces", used, reads=reads) as written:
            content = traces_of(
                record.id, test=record.test, balls=len(record.clearance), paths=paths
            )
            write_whole(page, script("vinesexp.traces", record.id, content))
            written.append(page)
            for number, chunk in enumerate(samples_of(record.id, paths=paths)):
                samples.mkdir(parents=True, exist_ok=True)
                written.append(samples / f"{number}.js")
                write_whole(written[-1], script("vinesexp.samples", f"{record.id}/{number}", chunk))
    notes.renew()
    return notes.files("traces")


def _facts(campaign: Campaign, paths: ResultPaths) -> Iterable[Path]:
    """Write what is said of every record, and the page itself."""
    results = CampaignResults(paths.folder, campaign)
    for record in results.as_found.records:
        page = paths.pages / "facts" / f"{record.id}.js"
        write_whole(page, script("vinesexp.facts", record.id, facts_of(record, results)))
        yield page
    content = {
        "records": list_of_records(results),
        "manifold": manifold_curve(results.rig),
        "colours": COLOURS,
    }
    shown = {"campaign": campaign, "content": content, "library": LIBRARY}
    shown |= {"version": version("bokeh")}
    whole = rendered("vinesexp.record_pages", "records.html.j2", shown)
    write_whole(paths.records_page, whole)
