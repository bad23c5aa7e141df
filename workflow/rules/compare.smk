# Measured optimal clearances against predicted ones; every problem found; and, for a simulated
# campaign, what was found against the truth.


rule compare:
    input:
        identified=RESULTS / "identified.csv",
        regimes=RESULTS / "regimes.csv",
        times=RESULTS / "decay_times.csv",
    output:
        clearances=RESULTS / "clearances.csv",
        checks=RESULTS / "steps/compare.csv",
    log:
        RESULTS / "logs/compare.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.clearance.comparison"),
    message:
        "compare    measured and predicted clearances"
    script:
        "../scripts/compare.py"


rule checks:
    input:
        records=each_record(step("ingest.csv")),
        summaries=[RESULTS / "steps/identify.csv", RESULTS / "steps/compare.csv"],
    output:
        table=RESULTS / "checks.csv",
    log:
        RESULTS / "logs/checks.log",
    params:
        code=code_digest("vinesexp.records.checks"),
    message:
        "checks     of all steps"
    script:
        "../scripts/checks.py"


if SCENE:

    rule score:
        input:
            identified=RESULTS / "identified.csv",
            impacts=each_record(RESULTS / "impacts/{record}.csv"),
        output:
            table=RESULTS / "truth.csv",
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
