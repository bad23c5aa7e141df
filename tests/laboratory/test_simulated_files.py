"""Files of a scene are made once, whoever asks for them, and by one at a time."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier, local

from tests.laboratory.test_scene import scene_of

from vinesexp.laboratory import simulated_files
from vinesexp.laboratory.simulated_files import simulate_once, why_simulate


def test_of_two_that_find_no_files_one_simulates_and_the_other_takes_them(tmp_path, monkeypatch):
    scene, folder = scene_of(tmp_path), tmp_path / "out"
    both, mine = Barrier(2, timeout=30.0), local()

    def why(*of):
        found = why_simulate(*of)
        if not hasattr(mine, "asked"):  # neither begins before both have seen that nothing is there
            mine.asked = both.wait()
        return found

    monkeypatch.setattr(simulated_files, "why_simulate", why)
    with ThreadPoolExecutor(2) as pool:
        asked = [pool.submit(simulate_once, scene, "free", folder) for _ in range(2)]
        made = [one.result() for one in asked]
    assert sorted(map(len, made)) == [0, 2]
    monkeypatch.undo()
    assert simulate_once(scene, "free", folder) == []
    monkeypatch.setattr(simulated_files, "code_digest", lambda name: "other")
    assert len(simulate_once(scene, "free", folder)) == 2, "other code makes other files"
