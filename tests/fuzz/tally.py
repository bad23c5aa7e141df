"""What became of the cases of each target, as a table."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from .cases import Outcome

WORDS = ("refused", "looked at", "ok", "FOUND")


@dataclass
class Tally:
    """Counts, processor time and the slowest case of each target."""

    words: dict[str, Counter[str]] = field(default_factory=dict)
    spent: Counter[str] = field(default_factory=Counter)
    slowest: dict[str, tuple[float, str]] = field(default_factory=dict)

    def add(self, outcome: Outcome) -> None:
        target = outcome.case.partition(":")[0]
        self.words.setdefault(target, Counter())[outcome.word] += 1
        self.spent[target] += outcome.seconds
        slow = self.slowest.get(target, (0.0, ""))
        self.slowest[target] = max(slow, (outcome.seconds, outcome.case))

    @property
    def cases(self) -> int:
        return sum(sum(words.values()) for words in self.words.values())

    @property
    def found(self) -> int:
        return sum(words["FOUND"] for words in self.words.values())

    def table(self) -> str:
        """Markdown: a row a target, and the sum."""
        lines = [
            "| target | cases | refused | looked at | good | found | ms of the processor a case "
            "| slowest |",
            "|---" * 8 + "|",
        ]
        for target, words in self.words.items():
            n = sum(words.values())
            seconds, case = self.slowest[target]
            counts = " | ".join(str(words[word]) for word in WORDS)
            took = f"{1e3 * self.spent[target] / n:.1f} | {seconds:.1f} s ({case})"
            lines.append(f"| {target} | {n} | {counts} | {took} |")
        return "\n".join([*lines, "", f"{self.cases} cases, {self.found} found", ""])
