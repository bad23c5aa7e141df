# Simulated campaigns only: the instrument files of each group of tests, made from scene.yaml.
# A group depends on its own part of the scene, not on the file: editing one re-runs one. The
# files belong to the campaign, which other runs may read too: Snakemake, which removes what it
# is about to make, gets a note that they are there instead.

for GROUP in SCENE.groups if SCENE else ():

    rule:
        name:
            f"simulate_{GROUP}"
        input:
            PLAN.simulation(GROUP),
        output:
            PATHS.simulated(GROUP),
        log:
            PATHS.log("simulate", GROUP),
        params:
            group=GROUP,  # the call is made when the job runs, after the loop has ended
        message:
            f"simulate   {GROUP}"
        run:
            PLAN.run("simulate", log, output, group=params.group)
