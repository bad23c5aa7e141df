# Every record simulated again with the identified rig and the base as measured.


rule replay:
    input:
        identified=PATHS.identified,
        regimes=PATHS.regimes,
        base=PATHS.base,
        conditioned=each_record(PATHS.conditioned("{record}")),
    output:
        replay=PATHS.replay,
        cycles=PATHS.replay_cycles,
        checks=PATHS.replay_checks,
    log:
        RESULTS / "logs/replay.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        known=repr(CAMPAIGN.known),
        table=repr([replace(record, row=0, note="") for record in CAMPAIGN.records]),
        code=code_digest("vinesexp.replay.campaign_replay"),
    message:
        "replay     every record beside the identified rig"
    script:
        "../scripts/replay.py"
