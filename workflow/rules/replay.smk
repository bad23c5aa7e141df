# Every record simulated again with the identified rig and the base as measured.


rule replay:
    input:
        PLAN.before("replay"),
    output:
        table(PATHS.replay),
        PATHS.replay_cycles,
        PATHS.replay_checks,
    log:
        PATHS.log("replay"),
    message:
        "replay     every record beside the identified rig"
    run:
        PLAN.run("replay", log, output)
