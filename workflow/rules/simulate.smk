# Simulated campaigns only: the instrument files of each group of tests, made from scene.yaml.
# A group depends on its own part of the scene, not on the file: editing one re-runs one.

if SCENE:
    from vinesexp.laboratory.scene import group_files, group_text

    for group in SCENE.groups:

        rule:
            name:
                f"simulate_{group}"
            output:
                raw=[CAMPAIGN_FOLDER / path for path in group_files(SCENE, group)],
            log:
                RESULTS / "logs/simulate" / f"{group}.log",
            params:
                scene=str(SCENE_FILE),
                group=group,
                depends=group_text(SCENE, group),
                code=code_digest("vinesexp.laboratory.scene"),
            message:
                f"simulate   {group}"
            script:
                "../scripts/simulate.py"
