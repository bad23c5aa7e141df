"""Files of a scene are made once, whoever asks for them, and by one at a time."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier, local

from tests.laboratory.test_scene import scene_of

from vinesexp.laboratory import simulated_files
from vinesexp.laboratory.scene import raw_file
from vinesexp.laboratory.simulated_files import simulate_once
from vinesexp.records.stored.freshness import Notes


def test_of_two_that_find_no_files_one_simulates_and_the_other_takes_them(tmp_path, monkeypatch):
    scene, folder = scene_of(tmp_path), tmp_path / "out"
    test = scene.groups["free"][0]
    both, mine = Barrier(2, timeout=30.0), local()

    class Slow(Notes):
        def why_outdated(self, *of, **more):
            found = super().why_outdated(*of, **more)
            if not hasattr(mine, "asked"):  # neither begins before both have seen: nothing there
                mine.asked = both.wait()
            return found

    monkeypatch.setattr(simulated_files, "Notes", Slow)
    with ThreadPoolExecutor(2) as pool:
        asked = [pool.submit(simulate_once, scene, test, folder) for _ in range(2)]
        made = [one.result() for one in asked]
    assert sorted(made) == [False, True]
    monkeypatch.undo()
    content = (folder / raw_file(test)).read_bytes()
    assert not simulate_once(scene, test, folder)
    (folder / raw_file(test)).write_bytes(content[:-9])
    assert simulate_once(scene, test, folder), "a damaged file is made again"
    assert (folder / raw_file(test)).read_bytes() == content
    monkeypatch.setattr(simulated_files, "code_digest", lambda name: "other")
    assert simulate_once(scene, test, folder), "other code makes other files"
