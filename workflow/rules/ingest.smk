# Instrument file to calibrated channels on a uniform time axis, SI, nothing filtered.
# A record that cannot be used ends here as a row of checks.csv; the others go on.


def raw_file(wildcards):
    """The instrument file, where it exists or the scene makes it; a missing one is told by ingest."""
    path = CAMPAIGN.record(wildcards.record).file
    made = SCENE and path.resolve() in SIMULATED_FILES
    return [SIMULATED_FILES[path.resolve()] if made else path] if made or path.is_file() else []


SIMULATED_FILES = (
    {
        (CAMPAIGN_FOLDER / path).resolve(): CAMPAIGN_FOLDER / path
        for group in SCENE.groups
        for path in group_files(SCENE, group)
    }
    if SCENE
    else {}
)


rule ingest:
    input:
        raw=raw_file,
    output:
        record=PATHS.record("{record}"),
        checks=PATHS.ingest_checks("{record}"),
    log:
        RESULTS / "logs/ingest/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        depends=record_text,
        channels=repr((CAMPAIGN.channels, CAMPAIGN.time, CAMPAIGN.sample_rate)),
        code=code_digest("vinesexp.records.ingest"),
    message:
        "ingest     {wildcards.record}"
    script:
        "../scripts/ingest.py"
