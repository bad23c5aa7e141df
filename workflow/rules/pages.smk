# A page that shows any record, and what it loads: one job, which leaves alone what is still right.


rule pages:
    input:
        PLAN.before("pages", PATHS.records_page),
        PLAN.made("identify", PATHS.identified),
        PLAN.made("regimes", PATHS.regimes),
        PLAN.made("replay", PATHS.replay),
        PLAN.made("checks", PATHS.checks),
    output:
        report(PATHS.records_page, category="Report"),
    log:
        PATHS.log("pages"),
    message:
        "pages      of all records"
    run:
        PLAN.run("pages", log, output)
