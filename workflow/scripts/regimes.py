"""The regimes of all records in one table."""

import csv
import json
from pathlib import Path

from vinesexp.step import run_step


def main(regimes: list[str], out: str) -> str:
    rows = [json.loads(Path(path).read_text(encoding="utf-8")) for path in regimes]
    columns = dict.fromkeys(name for row in rows for name in row)
    with Path(out).open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(columns), restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows({k: "" if v is None else v for k, v in row.items()} for row in rows)
    return f"{len(rows)} records"


run_step(
    main,
    log=snakemake.log[0],
    regimes=list(snakemake.input.regimes),
    out=snakemake.output.table,
)
