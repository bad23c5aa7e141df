"""The regimes of all records in one table, the decay times of the releases in another."""

import json
from pathlib import Path

from vinesexp.records.result_columns import DECAY_TIMES, RECORD_REGIMES
from vinesexp.records.tables import write_rows
from vinesexp.step import run_step


def main(regimes: list[str], out: str, times: str) -> str:
    steps = [json.loads(Path(path).read_text(encoding="utf-8")) for path in regimes]
    write_rows(Path(out), RECORD_REGIMES, [step["regime"] for step in steps])
    write_rows(Path(times), DECAY_TIMES, [row for step in steps for row in step["times"]])
    return f"{len(steps)} records"


run_step(
    main,
    log=snakemake.log[0],
    regimes=list(snakemake.input.regimes),
    out=snakemake.output.table,
    times=snakemake.output.times,
)
