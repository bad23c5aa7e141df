# Every record simulated again with the identified rig and the base as measured.

REPLAY = code_of("vinesexp.pipeline:replay_records", script="replay")


rule replay:
    input:
        PLANNER.again("replay", REPLAY, PATHS.replay),
        identified=PATHS.identified,
        regimes=PATHS.regimes,
        base=PATHS.base,
        records=each_record(PATHS.record),
        conditioned=each_record(PATHS.conditioned),
    output:
        replay=report(PATHS.replay, category="Tables"),
        cycles=PATHS.replay_cycles,
        checks=PATHS.replay_checks,
    log:
        PATHS.log("replay"),
    params:
        about=PLANNER.about("replay", REPLAY),
    message:
        "replay     every record beside the identified rig"
    script:
        "../scripts/replay.py"
