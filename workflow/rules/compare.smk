# Measured optimal clearances against predicted ones; every problem found; and, for a simulated
# campaign, what was found against the truth.

COMPARE = code_of("vinesexp.pipeline:compare_clearances", script="compare")
COLLECT_CHECKS = code_of("vinesexp.pipeline:collect_checks", script="checks")


rule compare:
    input:
        PLANNER.again("compare", COMPARE, PATHS.clearances),
        identified=PATHS.identified,
        budget=PATHS.rig_budget,
        levels=PATHS.level_values,
        regimes=PATHS.regimes,
        base=PATHS.base,
        times=PATHS.decay_times,
    output:
        clearances=report(PATHS.clearances, category="Tables"),
        budget=report(PATHS.budget, category="Tables"),
        checks=PATHS.compare_checks,
    log:
        PATHS.log("compare"),
    params:
        about=PLANNER.about("compare", COMPARE),
    message:
        "compare    measured and predicted clearances"
    script:
        "../scripts/compare.py"


rule checks:
    input:
        PLANNER.again("checks", COLLECT_CHECKS, PATHS.checks),
        records=each_record(PATHS.ingest_checks),
        refused=each_record(PATHS.regime),
        summaries=[PATHS.identify_checks, PATHS.compare_checks, PATHS.replay_checks],
    output:
        table=report(PATHS.checks, category="Tables"),
    log:
        PATHS.log("checks"),
    params:
        about=PLANNER.about("checks", COLLECT_CHECKS),
    message:
        "checks     of all steps"
    script:
        "../scripts/checks.py"


if SCENE:
    SCORE = {
        **code_of("vinesexp.laboratory.score", script="score"),
        "truth": repr((SCENE.truth(), [(test.record, test.duration) for test in SCENE.tests])),
    }
    TRUTH_FILES = [CAMPAIGN_FOLDER / truth_file(test) for test in SCENE.tests]

    rule score:
        input:
            PLANNER.again("score", SCORE, PATHS.truth),
            simulated=[PATHS.simulated(group) for group in SCENE.groups],
            identified=PATHS.identified,
            impacts=each_record(PATHS.impacts),
        output:
            table=report(PATHS.truth, category="Tables"),
        log:
            PATHS.log("score"),
        params:
            about=PLANNER.about("score", SCORE, reads=TRUTH_FILES),
        message:
            "score      against the truth of the scene"
        script:
            "../scripts/score.py"
