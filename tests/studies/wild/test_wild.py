# SPDX-License-Identifier: Apache-2.0
"""The study of other people's files: how materials are counted, in which order they are taken, and one file read."""

from __future__ import annotations

import subprocess
import sys

from studies.wild.__main__ import child, in_turn
from studies.wild.rows import how_read, reading_table, recovery_table

FINE = {"material": "Wood", "sort": "principled", "errors": [], "notes": ["Clamping of indirect light may differ."]}
GAP = {"material": "Gold", "sort": "mix", "errors": [], "notes": ["Material 'Gold': Normal is left out."]}
REFUSED = {
    "material": "Ice",
    "sort": "glass",
    "errors": ["Material 'Ice' has no Principled BSDF."],
    "notes": GAP["notes"],
}
LAMP = {"material": "Lamp", "sort": "emission", "errors": ["Material 'Lamp' has no Principled BSDF."], "notes": []}


def test_notes_on_the_scene_or_another_material_are_no_gap_of_this_one():
    assert [how_read(m) for m in (FINE, GAP, REFUSED)] == ["fully", "with gaps", "refused"]
    assert how_read({**FINE, "notes": GAP["notes"]}) == "fully"
    assert (
        how_read({**GAP, "notes": ["Material 'Gold': the image is missing; it is magenta, as in Cycles."]}) == "fully"
    )


def test_what_no_camera_sees_has_no_picture_and_does_not_count():
    hidden = {**FINE, "errors": ["The camera does not see 'Cube': it is hidden behind 'Wall'."]}
    assert how_read(hidden) == "not seen"
    text = reading_table([{"file": "a/x.blend", "materials": [FINE, hidden, REFUSED]}])
    assert text.startswith(
        "1 files (0 could not be opened), 2 materials (bare emission apart, and 1 that no camera saw)"
    )
    assert "| fully | 1 | 50 % |" in text


def test_bare_emission_does_not_count_and_sentences_of_one_kind_count_together():
    ice = {**REFUSED, "material": "Snow", "errors": ["Material 'Snow' has no Principled BSDF."]}
    text = reading_table(
        [{"file": "a/x.blend", "materials": [FINE, GAP, REFUSED, ice, LAMP]}, {"file": "b", "failed": "x"}]
    )
    assert text.startswith("2 files (1 could not be opened), 4 materials (bare emission apart, and 0")
    assert "| fully | 1 | 25 % |" in text
    assert "| refused | 2 | 50 % |" in text
    assert "| Material '...' has no Principled BSDF. | 2 |" in text


def test_a_verdict_is_wrong_only_where_it_says_the_same_far_above_the_floor():
    common = {"file": "a", "material": "m", "before": 0.3, "floor": 0.01, "seconds": 3.0}
    rows = [
        {**common, "after": 0.02, "verdict": "same"},
        {**common, "after": 0.07, "verdict": "same"},
        {**common, "after": 0.07, "verdict": "different"},
        {"file": "a", "material": "n", "why": "no"},
    ]
    assert recovery_table(rows).startswith("3 fits, 1 refused; 1 within 0.02 FLIP of the floor; 1 called the same")


def test_the_authors_come_in_turn():
    rows = [{"file": f"a/{i}.blend", "materials": [FINE, LAMP]} for i in range(3)] + [
        {"file": "b/0", "materials": [GAP]}
    ]
    assert [m["file"][0] for m in in_turn(rows)] == ["a", "b", "a", "a"]


def test_a_file_is_read_in_a_process_of_its_own(tmp_path):
    path = tmp_path / "cube.blend"
    code = f"import bpy, os; bpy.ops.wm.save_as_mainfile(filepath={str(path)!r}); os._exit(0)"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    (row,) = child(["studies.wild.in_blender", "read", str(path)], 60.0)["materials"]
    assert (row["object"], row["sort"], row["errors"], row["view"]) == ("Cube", "principled", [], -1)


def test_another_seed_is_another_order():
    rows = [{"file": "a/0", "materials": [FINE | {"material": str(number)} for number in range(20)]}]
    orders = [[m["material"] for m in in_turn(rows, seed)] for seed in (20, 20, 21)]
    assert orders[0] == orders[1] != orders[2]


def test_values_inside_nodes_are_moved_where_asked_for(tmp_path):
    path = tmp_path / "cube.blend"
    code = (
        "import bpy, os\n"
        "tree = bpy.data.materials['Material'].node_tree\n"
        "ramp = tree.nodes.new('ShaderNodeValToRGB')\n"
        "tree.links.new(ramp.outputs[0], tree.nodes['Principled BSDF'].inputs['Base Color'])\n"
        f"bpy.ops.wm.save_as_mainfile(filepath={str(path)!r})\n"
        "os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    words = ["studies.wild.in_blender", "prepare", str(path), "--object=Cube", "--seed=3", "--size=8", "--samples=1"]
    plain, inside = (child([*words, f"--out={tmp_path}", *more], 60.0)["moved"] for more in ([], ["--inside"]))
    assert plain == ["Roughness", "Metallic"]
    assert inside == [*plain, "Color Ramp (inside)"]
