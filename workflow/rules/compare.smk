# Measured optimal clearances against predicted ones; every problem found; and, for a simulated
# campaign, what was found against the truth.


rule compare:
    input:
        identified=PATHS.identified,
        regimes=PATHS.regimes,
        base=PATHS.base,
        times=PATHS.decay_times,
    output:
        clearances=PATHS.clearances,
        checks=PATHS.compare_checks,
    log:
        RESULTS / "logs/compare.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.clearance.comparison"),
    message:
        "compare    measured and predicted clearances"
    script:
        "../scripts/compare.py"


rule checks:
    input:
        records=each_record(PATHS.ingest_checks("{record}")),
        summaries=[PATHS.identify_checks, PATHS.compare_checks],
    output:
        table=PATHS.checks,
    log:
        RESULTS / "logs/checks.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        code=code_digest("vinesexp.records.checks"),
    message:
        "checks     of all steps"
    script:
        "../scripts/checks.py"


if SCENE:

    rule score:
        input:
            identified=PATHS.identified,
            impacts=each_record(PATHS.impacts("{record}")),
        output:
            table=PATHS.truth,
        log:
            RESULTS / "logs/score.log",
        params:
            scene=str(SCENE_FILE),
            truth=repr(SCENE.truth()),
            code=code_digest("vinesexp.laboratory.score"),
        message:
            "score      against the truth of the scene"
        script:
            "../scripts/score.py"
