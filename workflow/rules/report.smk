# Figures of single records and of the results, and the page that holds them.


rule figures_records:
    input:
        PLAN.before("figures_records", PATHS.figures("records")),
    output:
        PATHS.figures("records"),
    log:
        PATHS.log("figures_records"),
    message:
        "figures    of the records"
    run:
        PLAN.run("figures_records", log, output)


rule figures_results:
    input:
        PLAN.before("figures_results", PATHS.figures("results")),
        PLAN.made("identify", PATHS.identified),
        PLAN.made("regimes", PATHS.regimes),
        PLAN.made("compare", PATHS.clearances),
        PLAN.made("replay", PATHS.replay),
    output:
        PATHS.figures("results"),
    log:
        PATHS.log("figures_results"),
    message:
        "figures    of the results"
    run:
        PLAN.run("figures_results", log, output)


rule report:
    input:
        PLAN.before("report", PATHS.report),
        PLAN.made("identify", PATHS.identified),
        PLAN.made("regimes", PATHS.regimes),
        PLAN.made("compare", PATHS.clearances),
        PLAN.made("replay", PATHS.replay),
        PLAN.made("checks", PATHS.checks),
        PLAN.made("figures_results", PATHS.figures("results")),
        PLAN.made("figures_records", PATHS.figures("records")),
        PLAN.made("score", PATHS.truth),
    output:
        report(PATHS.report, category="Report"),
    log:
        PATHS.log("report"),
    message:
        "report     of all results"
    run:
        PLAN.run("report", log, output)


# On request, `snakemake bundle`: all that others may want, in one file.
rule bundle:
    input:
        PLAN.before("bundle", PATHS.bundle),
        PLAN.made("report", PATHS.report),
        PLAN.made("pages", PATHS.records_page),
        PLAN.made("score", PATHS.truth),
    output:
        PATHS.bundle,
    log:
        PATHS.log("bundle"),
    message:
        "bundle     of all results"
    run:
        PLAN.run("bundle", log, output)
