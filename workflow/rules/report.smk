# Figures of single records and of the results, and the page that holds them.


rule figures_records:
    input:
        PLAN.before("figures_records"),
    output:
        PATHS.figures_records,
    log:
        PATHS.log("figures_records"),
    message:
        "figures    of the records"
    run:
        PLAN.run("figures_records", log, output)


rule figures_results:
    input:
        PLAN.before("figures_results"),
    output:
        PATHS.figures_results,
    log:
        PATHS.log("figures_results"),
    message:
        "figures    of the results"
    run:
        PLAN.run("figures_results", log, output)


rule report:
    input:
        PLAN.before("report"),
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
        PLAN.before("bundle"),
    output:
        PATHS.bundle,
    log:
        PATHS.log("bundle"),
    message:
        "bundle     of all results"
    run:
        PLAN.run("bundle", log, output)
