"""The result page of the benchmark of finding impacts, and its figure."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.detection_score import Score
from benchmarks.pages import code_measured

from vinesexp.figures.style import COLOURS, SEQUENCE, label, new_figure, shortened_svg

METHODS = ("vinesexp", "find_peaks", "STA/LTA", "matched filter")
LOOKS = {
    "vinesexp": (COLOURS["impact"], "*"),
    "find_peaks": (SEQUENCE[0], "o"),
    "STA/LTA": (SEQUENCE[2], "s"),
    "matched filter": (SEQUENCE[3], "D"),
}

HEAD = """# Finding impacts

Made by `python -m benchmarks.impacts` with the code of CODE. Every method gets the same
accelerations of the virtual rig of Table 2: half-sine contacts of 0.4 ms, base at 0.25 mm and
7.862 Hz, b = 30 mm, 10 kHz, 16 bits, white noise of 0.3 m/s^2 at 10 kHz and of that density
elsewhere, unless the row says otherwise. S/N is the highest sample of a median contact over the
noise of a sample. Nothing is set for vinesexp, the detector `template`. The others are those that
`settings: impacts: detector:` in campaign.yaml chooses (`find_peaks`, `sta_lta`, `matched_filter`):
they work behind the same highpass, know the length of a contact, and place an impact at the top of
their score by a parabola.

- An impact counts where its velocity jump exceeds 5 % of the record's median; impacts closer than
  half a contact or two samples are one. *missed / hidden / false* are of vinesexp; *hidden* are the
  missed ones that stand less than eight standard deviations out of the noise even for a filter that
  knows the contact.
- *bias* holds how late the sensor makes slow motions, as impacts are timed to fit the displacement
  behind the same sensor: 2 zeta/w of a mount that rings, 15.9 us at 2 kHz and damping 0.1.
- *spread* is 1.4826 times the median deviation from the bias, of impacts 4 ms from any other.
- The limit is that of Cramer and Rao for one contact: form (half sine, resonance, sampling) and
  duration known, noise white, clipped samples worth nothing; unknown are its time, its height and a
  constant under it. FREE No limit below 5 kHz, where a contact may fall within one sample, nor
  where clipping leaves too few samples.

![F1 and spread against signal to noise; worst F1 of each kind of record](impacts.svg)
"""


def page(
    scores: Sequence[Score],
    twin: Sequence[Score],
    speeds: Sequence[Any],
    worth: Sequence[str],
    *,
    free: float,
) -> str:
    """The whole page; `free`: the limit with the duration unknown over that with it known."""
    known = f"With the duration unknown too the limit is {free:.3f} times as large."
    head = HEAD.replace("CODE", code_measured()).replace("FREE", known)
    lines = [head, "## Targets", "", *_targets(scores, twin, speeds), ""]
    for group in dict.fromkeys(s.group for s in scores):
        lines += [f"## By {group}", "", *_table([s for s in scores if s.group == group]), ""]
    names = " | ".join(f"{m}, all" for m in METHODS)
    lines += [
        "## The shipped campaign",
        "",
        "The records of `data/twin` with impacts, as their instruments hold them (14 bits).",
        "",
        *_table(_summed(twin)),
        "",
        *worth,
        "## Speed",
        "",
        "Million samples a second of the processor, four million with an impact every 64 ms, on a",
        "machine with other work.",
        "*First pass* looks at every sample, by pieces as a record is read; *detection* adds",
        "learning the pulse and fitting every contact; *all* adds the filter.",
        "",
        f"| sample rate | first pass | detection | {names} |",
        "|---|---|---|" + "---|" * len(METHODS),
    ]
    for s in speeds:
        whole = " | ".join(f"{s.whole[m]:.1f}" for m in METHODS)
        lines.append(f"| {s.name} | {s.first_pass:.1f} | {s.detection:.1f} | {whole} |")
    return "\n".join([*lines, ""])


def _targets(scores: Sequence[Score], twin: Sequence[Score], speeds: Sequence[Any]) -> list[str]:
    mine = [s for s in twin if s.method == METHODS[0]]
    own = [s for s in scores if s.method == METHODS[0]]
    noisy = [s for s in own if s.group == "signal to noise"]
    perfect = [s for s in noisy if not s.missed and not s.false]
    false = sum(s.false for s in noisy)
    five = next(s for s in noisy if s.scene == "S/N 5")
    single = _sum([s for s in mine if s.scene.startswith("periodic")], "")
    total = _sum(mine, "all")
    worst = min(mine, key=lambda s: s.f1)
    clear = min(mine, key=lambda s: s.clear_f1)
    timed = [
        s for s in [*mine, *own]
        if s.ratio > 0.0 and s.recall > 0.5 and not s.scene.startswith("clipped")
    ]  # fmt: skip
    spread = max(timed, key=lambda s: s.ratio)
    return [
        "| target | measured |",
        "|---|---|",
        "| no missed and no false impact above five times the noise, one NES, periodic | "
        f"shipped campaign: {single.missed} missed, {single.false} false of {single.true}; "
        f"noise raised: none missed from {perfect[0].scene} on, {false} false at any; at S/N 5 "
        f"{100 * (1 - five.recall):.0f} % missed, where a filter that knows the contact misses "
        f"{100 * (1 - five.expected):.0f} % at the same threshold |",
        "| F1 at least 0.995 over all scenes, jumps above 5 % of the median | shipped campaign: "
        f"{total.f1:.4f} all in all, worst record {worst.f1:.4f} ({worst.scene}); without those "
        f"hidden in the noise {total.clear_f1:.4f} and {clear.clear_f1:.4f} ({clear.scene}) |",
        f"| spread at most 1.5 times the limit | at most {spread.ratio:.2f} ({spread.scene}), "
        "clipped records apart |",
        "| 20 million samples a second on the first pass | "
        f"{min(s.first_pass for s in speeds):.1f} |",
    ]


def _table(scores: Sequence[Score]) -> list[str]:
    lines = [
        "| record | impacts | missed / hidden / false | bias (us) | spread (us) | "
        + " | ".join(f"{m}: F1, spread over limit" for m in METHODS) + " |",
        "|---|---|---|---|---|" + "---|" * len(METHODS),
    ]  # fmt: skip
    for scene in dict.fromkeys(s.scene for s in scores):
        by = {s.method: s for s in scores if s.scene == scene}
        own = by[METHODS[0]]
        lines.append(
            f"| {scene} | {own.true} | {own.missed} / {own.hidden} / {own.false} | "
            f"{_number(1e6 * own.bias)} | {_number(1e6 * own.spread)} | "
            + " | ".join(f"{by[m].f1:.4f}, {_number(by[m].ratio)}" for m in METHODS if m in by)
            + " |"
        )
    return lines


def _number(x: float) -> str:
    return "-" if math.isnan(x) else f"{x:.2f}"


def _kind(scene: str) -> str:
    kind, *sizes = scene.split("_")
    two = sum(part.startswith("b") for part in sizes) > 1
    return f"{kind}, {'two NESs' if two else 'one NES'}"


def _summed(twin: Sequence[Score]) -> list[Score]:
    kinds = dict.fromkeys(_kind(s.scene) for s in twin)
    return [
        _sum([s for s in twin if s.method == m and _kind(s.scene) == kind], kind)
        for kind in kinds
        for m in METHODS
    ]


_COUNTS = ("true", "found", "missed", "hidden", "false")


def _sum(scores: Sequence[Score], name: str) -> Score:
    """Counts added, errors as means weighted by impacts."""
    weight = [s.true if not math.isnan(s.ratio) else 0 for s in scores]

    def mean(of: Callable[[Score], float]) -> float:
        values = [w * of(s) for w, s in zip(weight, scores, strict=True) if w]
        return sum(values) / sum(weight) if values else float("nan")

    return Score(
        scores[0].group, name, scores[0].method,
        *(sum(getattr(s, name) for s in scores) for name in _COUNTS),
        mean(lambda s: s.expected), mean(lambda s: s.bias), mean(lambda s: s.spread),
        mean(lambda s: s.limit), mean(lambda s: s.ratio), mean(lambda s: s.std_ratio),
        sum(s.seconds for s in scores), sum(s.samples for s in scores),
    )  # fmt: skip


#: Kind of record in the figure: which scenes.
KINDS: dict[str, Callable[[Score], bool]] = {
    "1 and 2 kHz": lambda s: s.scene in ("1 kHz", "2 kHz"),
    "5 to 200 kHz": lambda s: s.scene in ("5 kHz", "10 kHz", "50 kHz", "200 kHz"),
    "sensor rings": lambda s: s.scene.startswith("rings"),
    "clipped": lambda s: s.scene.startswith("clipped") and "rings" not in s.scene,
    "clipped and ringing": lambda s: s.scene.startswith("clipped") and "rings" in s.scene,
    "slow sensor": lambda s: s.scene.startswith("bandwidth"),
    "two NESs": lambda s: s.scene.startswith("two"),
    "campaign, one NES": lambda s: s.group == "twin" and "one" in _kind(s.scene),
    "campaign, two NESs": lambda s: s.group == "twin" and "two" in _kind(s.scene),
}


def draw(scores: Sequence[Score], twin: Sequence[Score], path: Path) -> None:
    """F1 and spread against S/N, and the worst F1 of each kind of record."""
    figure, axes = new_figure(1, 3, height=3.2, width_ratios=(0.85, 1.0, 1.15))
    noisy = [s for s in scores if s.group == "signal to noise"]
    for place, (method, (colour, marker)) in enumerate(LOOKS.items()):
        own = [s for s in noisy if s.method == method]
        snr = [float(s.scene.split()[1]) for s in own]
        style: dict[str, Any] = {"color": colour, "marker": marker, "zorder": 9 - place}
        style["markersize"] = 9 if method == METHODS[0] else 4.5
        axes[0].plot(snr, [s.f1 for s in own], **style)
        use = [i for i, s in enumerate(own) if s.recall > 0.5]
        axes[1].plot([snr[i] for i in use], [own[i].ratio for i in use], **style)
        every = [s for s in [*scores, *twin] if s.method == method]
        rows = [min(s.f1 for s in every if of(s)) for of in KINDS.values()]
        heights = [k + 0.18 * (place - 1.5) for k in range(len(rows))]
        axes[2].plot(rows, heights, ls="none", **style, label=method, clip_on=False)
    axes[0].set(xscale="log", xlabel="S/N", title="F1", xlim=(2.7, 21), ylim=(0.0, 1.02))
    axes[0].set_xticks([3, 5, 7, 10, 20], ["3", "5", "7", "10", "20"])
    axes[1].set(xscale="log", yscale="log", xlabel="S/N", ylim=(0.75, 8.0), xlim=(4, 250),
                title="spread of times over the limit")  # fmt: skip
    axes[1].set_xticks([5, 10, 20, 50, 200], ["5", "10", "20", "50", "200"])
    axes[1].set_yticks([1, 2, 5], ["1", "2", "5"])
    for axis in axes[:2]:
        axis.minorticks_off()
    axes[1].axhline(1.5, color=COLOURS["bare"], lw=0.8, ls=(0, (4, 3)))
    label(axes[1], "target", (4.2, 1.5), colour=COLOURS["bare"], shift=(0.0, 6.0))
    axes[1].axhline(1.0, color=COLOURS["measured"], lw=0.8)
    label(axes[1], "limit of Cramer and Rao", (9.0, 1.0), colour=COLOURS["measured"],
          shift=(0.0, -10.0))  # fmt: skip
    axes[2].set(yticks=range(len(KINDS)), yticklabels=list(KINDS), title="worst F1 of a record")
    axes[2].invert_yaxis()
    axes[2].set_xlim(0.2, 1.0)
    figure.legend(*axes[2].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, metadata={"Date": None})
    path.write_text(shortened_svg(path.read_text(encoding="utf-8")), encoding="utf-8")
    figure.savefig(os.environ.get("PREVIEW", os.devnull), format="png", dpi=110)
