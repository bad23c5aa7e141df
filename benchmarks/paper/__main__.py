"""Every claim of the paper with a verdict, and the figures that show it.

    python -m benchmarks.paper          # about two minutes

writes docs/paper.md and docs/figures/paper/*.svg. Claims are in data/paper/claims.csv; one without
a verdict is an error.
"""

from __future__ import annotations

import csv
import sys

from benchmarks.paper.off_resonance import one_clearance
from benchmarks.paper.regimes import section_2_2
from benchmarks.paper.release_course import section_3_2
from benchmarks.paper.release_regimes import figure_5_and_6
from benchmarks.paper.releases import figures_13_and_14
from benchmarks.paper.resonance import figure_9
from benchmarks.paper.rig import ROOT, WORDS, Verdicts
from benchmarks.paper.several import section_4
from benchmarks.paper.simulated import figure_2, figure_3, figure_4
from benchmarks.paper.sweeps import figures_10_and_11
from benchmarks.paper.table_1 import table_1

PAGE = ROOT / "docs" / "paper.md"
SECTIONS = (
    ("Figure 2: the SIM", figure_2),
    ("Section 2.2: the five regimes", section_2_2),
    ("Figure 3: strongly modulated and steady response", figure_3),
    ("Figure 4: amplitude over clearance, G = 0.25 mm", figure_4),
    ("Figures 5 and 6: release from 30 mm", figure_5_and_6),
    ("Table 1", table_1),
    ("Section 3.2: the course of a release", section_3_2),
    ("Section 4: several NESs", section_4),
    ("Figure 9: resonance", figure_9),
    ("Section 5.1: beside resonance", one_clearance),
    ("Figures 10 and 11: sweeps", figures_10_and_11),
    ("Figures 13 and 14: release from 20 mm", figures_13_and_14),
)
SLIPS = (
    "- Equation (2) prints cos for sin; (23) lambda C/2 for lambda A/2; in (24) to (33) A is C.",
    "- (24) prints f1/g for f1/(pi g); f2/g is right.",
    "- (39) leaves out the index of Y, (43) alpha_i in its sums.",
    "- Table 1, b = 80 mm: x1 is printed as 11.8 mm; A_1 b = 12.57 mm; x2 as 48.2 for 48.0 mm.",
    "- (34) and (36) give the folded singularity, not where the fixed point leaves the stable "
    "branch "
    "([theory](theory.md), section 3).",
)


def claims() -> list[dict[str, str]]:
    """Rows of data/paper/claims.csv."""
    with (ROOT / "data/paper/claims.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def page(verdicts: Verdicts, sections: list[str]) -> str:
    """The whole page: verdicts first."""
    rows = claims()
    known = {row["claim"] for row in rows}
    if known != set(verdicts):
        raise SystemExit(f"claims and verdicts differ: {sorted(known ^ set(verdicts))}")
    words = [verdicts[row["claim"]].word for row in rows]
    said = dict(zip(WORDS, ("agree", "agree in part", "differ", "cannot be judged"), strict=True))
    counts = ", ".join(f"{words.count(word)} {said[word]}" for word in WORDS if word in words)
    table = ["| source | claim | verdict | found |", "|---|---|---|---|"]
    for row in rows:
        one = verdicts[row["claim"]]
        table.append(f"| {row['source']} | {row['text']} | **{one.word}** | {one.found} |")
    lines = [
        "# Comparison with the paper",
        "",
        "Made by `python -m benchmarks.paper`. Qiu, Seguy and Paredes, J. Sound Vib. 442 (2019)",
        "497-513, beside what this package finds with the rig of its Table 2: theory, and exact "
        "event",
        f"simulation from many ball starts. Of {len(rows)} claims: {counts}. What is printed as "
        f"a number",
        "or said in words is judged; curves that are only drawn are not read off.",
        "",
        "## Verdicts",
        "",
        *table,
        "",
        "Misprints:",
        "",
        *SLIPS,
        "",
        *sections,
    ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> int:
    verdicts: Verdicts = {}
    sections: list[str] = []
    for title, make in SECTIONS:
        print(title, flush=True)
        lines, found = make()
        verdicts |= found
        sections += [f"## {title}", "", *lines, ""]
    PAGE.write_text(page(verdicts, sections), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
