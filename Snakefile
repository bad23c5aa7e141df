# From a campaign folder to results/<campaign>/report.html.
#   snakemake                                   the default campaign, data/twin
#   snakemake --config campaign=PATH            any other
#   snakemake --config results=DIR              results elsewhere


include: "workflow/rules/campaign.smk"


rule all:
    default_target: True
    input:
        RESULTS / "report.html",
        RESULTS / "identified.csv",
        RESULTS / "regimes.csv",
        RESULTS / "clearances.csv",
        RESULTS / "checks.csv",
        expand(RESULTS / "impacts/{record}.csv", record=RECORDS),
        ([RESULTS / "truth.csv"] if SCENE else []),
    message:
        f"done: {RESULTS / 'report.html'}"


include: "workflow/rules/simulate.smk"
include: "workflow/rules/ingest.smk"
include: "workflow/rules/condition.smk"
include: "workflow/rules/impacts.smk"
include: "workflow/rules/identify.smk"
include: "workflow/rules/compare.smk"
include: "workflow/rules/replay.smk"
include: "workflow/rules/report.smk"
