# Simulated campaigns only: the instrument files of each group of tests, made from scene.yaml.
# A group depends on its own part of the scene, not on the file: editing one re-runs one. The
# files belong to the campaign, which other runs may read too: Snakemake, which removes what it
# is about to make, gets a note that they are there instead.

if SCENE:
    from vinesexp.laboratory.scene import group_files, truth_file
    from vinesexp.laboratory.simulated_files import made_by_simulation, what_files_depend_on

    SIMULATE = code_digest("vinesexp.laboratory.scene")
    SIMULATED_IN = {
        (CAMPAIGN_FOLDER / path).resolve(): group
        for group in SCENE.groups
        for path in group_files(SCENE, group)
    }

    for group in SCENE.groups:

        rule:
            name:
                f"simulate_{group}"
            input:
                PLANNER.again_file(
                    PATHS.simulated(group),
                    made_by_simulation(CAMPAIGN_FOLDER, group),
                    what_files_depend_on(SCENE, group, code=SIMULATE),
                ),
            output:
                note=PATHS.simulated(group),
            log:
                PATHS.log("simulate", group),
            params:
                scene=str(SCENE_FILE),
                group=group,
                code=SIMULATE,
            message:
                f"simulate   {group}"
            script:
                "../scripts/simulate.py"
