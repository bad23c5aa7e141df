# What is done with one record: the samples of an instrument file become channels, impacts and
# estimates. Each job goes through a batch of records and passes over those whose results hold.


if PLAN.study.scene:

    # These files belong to the campaign, which other runs may read too: Snakemake, which removes what
    # it is about to make, does not know them.
    rule simulate:
        "Simulated campaigns only: the instrument file of each record, made from scene.yaml: raw/*."
        output:
            temp(touch(PATHS.batch("simulate", "{batch}"))),
        log:
            PATHS.log("simulate.{batch}"),
        run:
            PLAN.run("simulate", wildcards.batch)


rule ingest:
    "Instrument file to calibrated channels, SI, on a uniform time axis: records/*.nc."
    input:
        PLAN.before("ingest"),
    output:
        temp(touch(PATHS.batch("ingest", "{batch}"))),
    log:
        PATHS.log("ingest.{batch}"),
    run:
        PLAN.run("ingest", wildcards.batch)


rule condition:
    "Zero-phase bandpass: the motion of the oscillator and the band of the impacts: conditioned/*.nc."
    input:
        PLAN.before("condition"),
    output:
        temp(touch(PATHS.batch("condition", "{batch}"))),
    log:
        PATHS.log("condition.{batch}"),
    run:
        PLAN.run("condition", wildcards.batch)


rule impacts:
    "Acceleration spikes to impacts, impacts/*.csv, and the regime that they show."
    input:
        PLAN.before("impacts"),
    output:
        temp(touch(PATHS.batch("impacts", "{batch}"))),
    log:
        PATHS.log("impacts.{batch}"),
    run:
        PLAN.run("impacts", wildcards.batch)


rule estimate:
    "What each record alone says about M, c1, k1 and r."
    input:
        PLAN.before("estimate"),
    output:
        temp(touch(PATHS.batch("estimate", "{batch}"))),
    log:
        PATHS.log("estimate.{batch}"),
    run:
        PLAN.run("estimate", wildcards.batch)


# `snakemake results/twin/impacts/b34.csv`: one result of one record, and what it needs. The call of
# a rule made in a loop is made when the job runs: what it needs goes through params.
for STEP, FILE in (
    ("ingest", PATHS.record("{batch}")),
    ("condition", PATHS.conditioned("{batch}")),
    ("impacts", PATHS.impacts("{batch}")),
):

    rule:
        name:
            f"named_{STEP}"
        input:
            PLAN.before(STEP),
        output:
            FILE,
        log:
            PATHS.log(f"{STEP}.{{batch}}"),
        params:
            step=STEP,
        run:
            PLAN.run(params.step, wildcards.batch)
