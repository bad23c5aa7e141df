# Figures of single records and of the results, and the page that holds them.


rule figures:
    input:
        lambda wildcards: {
            "records": each_record(RESULTS / "records/{record}.nc")
            + each_record(RESULTS / "conditioned/{record}.nc")
            + each_record(RESULTS / "impacts/{record}.csv"),
            "results": [
                RESULTS / "identified.csv",
                RESULTS / "regimes.csv",
                RESULTS / "decay_times.csv",
                RESULTS / "clearances.csv",
            ],
        }[wildcards.family],
    output:
        manifest=RESULTS / "figures/{family}.json",
    log:
        RESULTS / "logs/figures/{family}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        table=repr([replace(record, row=0) for record in CAMPAIGN.records]),
        code=code_digest("vinesexp.figures.gallery"),
    message:
        "figures    of the {wildcards.family}"
    script:
        "../scripts/figures.py"


rule report:
    input:
        tables=[
            RESULTS / f"{name}.csv" for name in ("identified", "regimes", "clearances", "checks")
        ],
        figures=expand(RESULTS / "figures/{family}.json", family=["results", "records"]),
    output:
        page=RESULTS / "report.html",
    log:
        RESULTS / "logs/report.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        title=CAMPAIGN.title,
        code=code_digest("vinesexp.report.page"),
    message:
        "report     of all results"
    script:
        "../scripts/report.py"
