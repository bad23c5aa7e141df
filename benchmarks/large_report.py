"""Report and record pages of a small and a large campaign: sizes, time to make, time to open.

    python -m benchmarks.large_report [--records 60 1000] [--keep FOLDER]

The results are made up (tests/report/synthetic.py), six seconds at 1 kHz a record with two warnings
each. Opening is timed in headless Chromium, until everything is laid out; times of a record are
those of the first one, with the library, and of the next ones.
"""

from __future__ import annotations

import argparse
import re
import shutil
import statistics
import subprocess
import tempfile
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from urllib.parse import quote

from tests.report import synthetic

from vinesexp.figures.gallery import draw_all
from vinesexp.record_pages.build import build_pages
from vinesexp.records.stored.checks import Check, read_checks, write_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.report.page import build_report
from vinesexp.steps import all_modules

_LOADED = """<script>addEventListener("load", () => {
  document.body.offsetHeight;
  document.documentElement.dataset.loaded = performance.now().toFixed(0);
});</script></head>"""
#: Shows a few records one after the other, and notes how long each took until it was drawn. An open
#: frame holds back the load event, for which Chromium waits.
_STEPS = """<script>
const frame = document.createElement("iframe");
frame.hidden = true;
document.body.append(frame);
frame.contentDocument.open();
addEventListener("DOMContentLoaded", async () => {
  const times = [];
  const drawn = async () => {
    while (!document.body.dataset.drawn) await new Promise(done => setTimeout(done, 5));
  };
  await drawn();
  times.push(performance.now());
  for (let i = 0; i < 5; i++) {
    delete document.body.dataset.drawn;
    const begun = performance.now();
    step(1);
    await drawn();
    times.push(performance.now() - begun);
  }
  document.documentElement.dataset.times = times.map(t => t.toFixed(0)).join(" ");
  frame.contentDocument.close();
});</script></body>"""


def rows(count: int) -> list[str]:
    """Lines of records.csv: mostly periodic tests at ten levels, the rest of all kinds."""
    lines = []
    for i in range(count):
        kind, b = i % 20, 10 + 0.5 * (i // 20)
        if kind < 14:
            lines.append(f"p_{i},raw/p_{i}.csv,periodic,{b},{0.1 + 0.02 * (kind % 10):g},8,,,,")
        elif kind < 17:
            lines.append(f"t_{i},raw/t_{i}.csv,transient,{b},,,,20,,")
        elif kind < 19:
            lines.append(f"s_{i},raw/s_{i}.csv,sweep,{b},0.25,7.2:8.4,,,,")
        else:
            lines.append(f"rd_{i},raw/rd_{i}.csv,ringdown,,,,,20,,")
    return lines


def opened(page: Path, *, at: str = "", script: str = "", name: str) -> str:
    """An attribute that a page has set on itself, once it was opened."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        return ""
    copy = page.with_name(f"timed_{page.name}")
    text = page.read_text(encoding="utf-8").replace("</head>", _LOADED, 1)
    copy.write_text(text.replace("</body>", script or "</body>"), encoding="utf-8")
    with tempfile.TemporaryDirectory() as profile:
        done = subprocess.run(
            [chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1200,1000",
             f"--user-data-dir={profile}", "--timeout=30000", "--dump-dom", copy.as_uri() + at],
            capture_output=True, text=True, check=True, timeout=180,
        )  # fmt: skip
    copy.unlink()
    found = re.search(rf'data-{name}="([^"]*)"', done.stdout)
    return found[1] if found else ""


def measure(count: int, folder: Path) -> None:
    """Make everything for `count` records and print what it takes, libraries loaded before."""
    for module in all_modules():
        with suppress(ImportError):  # some are names in a module
            import_module(module)
    campaign = synthetic.make_campaign(folder / "large", rows(count))
    paths = ResultPaths(folder / "results")
    synthetic.make_results(campaign, paths.folder, parameters=tuple(synthetic.VALUES))
    odd = [Check(r.id, what, "warning", f"{r.id} is off by 3 %, look at its channel")
           for r in campaign.records for what in ("gain", "base amplitude")]  # fmt: skip
    write_checks(paths.checks, [*read_checks(paths.checks), *odd])
    print(f"{count} records")
    for name, make in (
        ("figures", lambda: draw_all(campaign, paths.folder)),
        ("report", lambda: build_report(campaign, paths.folder, paths.report)),
        ("pages", lambda: build_pages(campaign, paths=paths, code="")),
        ("pages, one record more", lambda: _once_more(campaign, paths)),
    ):
        begun = time.process_time()
        make()
        print(f"  {name}: {time.process_time() - begun:.1f} s of processor time")
    files = [path for path in paths.pages.rglob("*.js") if path.parent.name != "library"]
    library = sum(path.stat().st_size for path in (paths.pages / "library").iterdir())
    each = sum(path.stat().st_size for path in files) / count
    text = paths.report.read_text(encoding="utf-8")
    print(f"  report.html {len(text.encode()) / 1e6:.2f} MB, {text.count('<tr')} rows of tables")
    print(f"  records.html {paths.records_page.stat().st_size / 1e6:.2f} MB, library "
          f"{library / 1e6:.2f} MB, a record {each / 1e3:.0f} kB")  # fmt: skip
    page = paths.records_page.read_text(encoding="utf-8")
    shell = len(re.sub(r"json\">.*?</script>", "", page, flags=re.DOTALL).encode()) / 1e3
    print(f"  a page each would add {shell:.0f} kB a record, {shell * count / 1e3:.1f} MB")
    _time_opening(campaign.records[count // 2].id, paths)


def _once_more(campaign, paths: ResultPaths) -> None:
    made = paths.notes("traces", campaign.records[0].id)
    made.unlink()
    build_pages(campaign, paths=paths, code="")


def _time_opening(id: str, paths: ResultPaths) -> None:
    times = [opened(paths.report, name="loaded") for _ in range(3)]
    known = [float(text) for text in times if text]
    if not known:
        print("  not opened: no Chromium")
        return
    print(f"  report opens in {statistics.median(known):.0f} ms (of {', '.join(times)})")
    lists = opened(paths.records_page, name="loaded")
    print(f"  list of all records opens in {lists} ms")
    found = opened(paths.records_page, at="#" + quote(id), script=_STEPS, name="times").split()
    if found:
        following = ", ".join(found[1:])
        print(f"  a record opens in {found[0]} ms, the next ones in {following} ms")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, nargs="+", default=[60, 1000])
    parser.add_argument("--keep", type=Path, help="folder for the results, which then stay")
    arguments = parser.parse_args()
    for count in arguments.records:
        if arguments.keep:
            measure(count, arguments.keep / str(count))
        else:
            with tempfile.TemporaryDirectory() as folder:
                measure(count, Path(folder))


if __name__ == "__main__":
    main()
