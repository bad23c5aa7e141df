# Figures of single records and of the results, and the page that holds them.


rule figures:
    input:
        lambda wildcards: {
            "records": each_record(PATHS.record("{record}"))
            + each_record(PATHS.conditioned("{record}"))
            + each_record(PATHS.impacts("{record}")),
            "results": [
                PATHS.identified,
                PATHS.regimes,
                PATHS.base,
                PATHS.decay_times,
                PATHS.clearances,
            ],
        }[wildcards.family],
    output:
        manifest=PATHS.figures("{family}"),
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
            RESULTS / f"{name}.csv"
            for name in ("identified", "regimes", "base", "clearances", "checks")
        ],
        figures=expand(PATHS.figures("{family}"), family=["results", "records"]),
    output:
        page=PATHS.report,
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
