# Measured optimal clearances against predicted ones; every problem found; and, for a simulated
# campaign, what was found against the truth.


rule compare:
    input:
        PLAN.before("compare"),
    output:
        table(PATHS.clearances),
        table(PATHS.budget),
        PATHS.compare_checks,
    log:
        PATHS.log("compare"),
    message:
        "compare    measured and predicted clearances"
    run:
        PLAN.run("compare", log, output)


rule checks:
    input:
        PLAN.before("checks"),
    output:
        table(PATHS.checks),
    log:
        PATHS.log("checks"),
    message:
        "checks     of all steps"
    run:
        PLAN.run("checks", log, output)


if SCENE:

    rule score:
        input:
            PLAN.before("score"),
        output:
            table(PATHS.truth),
        log:
            PATHS.log("score"),
        message:
            "score      against the truth of the scene"
        run:
            PLAN.run("score", log, output)
