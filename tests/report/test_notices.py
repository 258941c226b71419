"""What was repaired is said, once."""

from __future__ import annotations

from femprep.report.notices import gather, mesh_notices, object_notices, wall_notices


def test_lines_are_gathered_from_all_depths_once() -> None:
    report = {"a": {"notices": ["one", "two"]}, "b": {"c": {"notes": ["two", "three"]}}, "notes": "no list"}
    assert gather({"notes": ["zero"]}, report) == ["zero", "one", "two", "three"]


def test_object_repairs_are_said_with_their_counts() -> None:
    report = {"removed_voxels": 12, "pieces": 3, "filled_voxels": 5, "voids": 1, "tunnels": 2}
    lines = object_notices("rv", report)
    assert lines[0] == "object rv: 12 voxels in 2 smaller pieces were left out"
    assert lines[1] == "object rv: 5 voxels in 1 voids were filled"
    assert "2 tunnels" in lines[2]
    assert object_notices("lv", {"removed_voxels": 0, "filled_voxels": 0, "tunnels": 0}) == []


def test_straightened_edges_of_swept_elements_are_said() -> None:
    assert mesh_notices({"straightened": 0}) == []
    (line,) = mesh_notices({"straightened": 7})
    assert line.startswith("7 edges of the template were made straight")


def test_what_is_assumed_of_the_heart_is_said_with_a_remedy() -> None:
    def lines(mirrored: bool | None, *assumed: str) -> list[str]:
        return mesh_notices({"axes": {"mirrored": mirrored, "info": {"assumed": list(assumed)}}})

    assert lines(False) == []
    assert "stored mirrored: its fibres were mirrored with it" in lines(True)[0]
    (hand,) = lines(None, "hand")
    assert "--flip, or --mirrored yes, mends that" in hand
    septal, hand = lines(None, "septal", "hand")
    assert "the septum was assumed" in septal


def test_openings_of_the_wall_are_told():
    cut = {"name": "mitral", "between": ["lv", "la"], "radius_mm": 11.5}
    left = {"name": "aortic", "between": ["lv", "outside"], "left_closed": "the aortic opening is not cut"}
    lines = wall_notices({"openings": [cut, left]})
    assert lines == [
        "the mitral opening between lv and la is cut with a radius of 11.5 mm",
        "the aortic opening is not cut",
    ]
