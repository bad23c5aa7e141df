# What all records say together: tables in results/<campaign>/.
from functools import partial

table = partial(report, category="Tables")  # Snakemake's own report lists them


rule regimes:
    "Regime, amplitudes, base and decay times of every record."
    input:
        PLAN.before("regimes"),
    output:
        table(PATHS.regimes),
        table(PATHS.base),
        table(PATHS.bands),
        table(PATHS.transitions),
        table(PATHS.decay_times),
    log:
        PATHS.log("regimes"),
    run:
        PLAN.run("regimes")


rule identify:
    "M, c1, k1 and r from all records at once, and what the records say of the test log."
    input:
        PLAN.before("identify"),
    output:
        table(PATHS.identified),
        table(PATHS.inputs),
        table(PATHS.level_values),
        PATHS.rig,
        PATHS.rig_budget,
        PATHS.identify_checks,
    log:
        PATHS.log("identify"),
    run:
        PLAN.run("identify")


rule compare:
    "Measured best clearances beside the predicted b_c and b_t."
    input:
        PLAN.before("compare"),
    output:
        table(PATHS.clearances),
        table(PATHS.budget),
        PATHS.compare_checks,
    log:
        PATHS.log("compare"),
    run:
        PLAN.run("compare")


rule replay:
    "Every record simulated again with the identified rig and the base as measured."
    input:
        PLAN.before("replay"),
    output:
        table(PATHS.replay),
        PATHS.replay_cycles,
        PATHS.replay_checks,
    log:
        PATHS.log("replay"),
    run:
        PLAN.run("replay")


rule checks:
    "Every problem that any step found, one row each."
    input:
        PLAN.before("checks"),
    output:
        table(PATHS.checks),
    log:
        PATHS.log("checks"),
    run:
        PLAN.run("checks")


if PLAN.study.scene:

    rule score:
        "Simulated campaigns only: what was found against the truth."
        input:
            PLAN.before("score"),
        output:
            table(PATHS.truth),
        log:
            PATHS.log("score"),
        run:
            PLAN.run("score")
