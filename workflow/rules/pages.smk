# A page that shows any record, and what it loads: one job, which leaves alone what is still right.

PAGES = code_of("vinesexp.record_pages.build", script="pages")


rule pages:
    input:
        PLANNER.again("pages", PAGES, PATHS.records_page),
        tables=[
            PATHS.identified,
            PATHS.regimes,
            PATHS.replay,
            PATHS.replay_cycles,
            PATHS.checks,
        ],
        records=each_record(PATHS.record),
        conditioned=each_record(PATHS.conditioned),
        impacts=each_record(PATHS.impacts),
        estimates=each_record(PATHS.estimates),
        decays=each_record(PATHS.decay),
    output:
        page=report(PATHS.records_page, category="Report"),
    log:
        PATHS.log("pages"),
    params:
        about=PLANNER.about("pages", PAGES),
    message:
        "pages      of all records"
    script:
        "../scripts/pages.py"
