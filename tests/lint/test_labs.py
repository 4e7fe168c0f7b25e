"""Check findings in complete pipelines: faults that OpenSim does not mention, and no false alarms."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from tests.cli.command import run
from tests.labs import change, copy_lab


def codes(path: Path) -> dict[str, str]:
    """Check a file or folder.

    Returns:
        The message of the last finding of each code, by code.
    """
    return {finding.code: finding.message for finding in osimlite.validate(path).findings}


def rewrite_table(path: Path, factor: float, columns: slice) -> None:
    """Multiply some columns of a storage file or a marker file by a factor."""
    lines = path.read_text().splitlines()
    storage = "endheader" in lines
    first = lines.index("endheader") + 2 if storage else 5
    for number, line in enumerate(lines[first:], first):
        cells = line.split("\t")
        if len(cells) > 3:
            cells[columns] = [
                f"{float(cell) * factor:.6f}" if cell.strip() else cell for cell in cells[columns]
            ]
            lines[number] = "\t".join(cells)
    path.write_text("\n".join(lines) + "\n")


SMOOTH = """<SmoothSphereHalfSpaceForce name="sole"><socket_sphere>/contactgeometryset/heel</socket_sphere>
<socket_half_space>/contactgeometryset/floor</socket_half_space></SmoothSphereHalfSpaceForce>"""
ELASTIC = "HuntCrossleyForce", "ElasticFoundationForce"


@pytest.mark.parametrize("kind", ["smooth", "elastic"])
def test_other_contacts_push_too(tmp_path: Path, kind: str) -> None:
    folder = copy_lab("ground", tmp_path)
    text = (folder / "leg.osim").read_text()
    start, end = (
        text.index("<HuntCrossleyForce name"),
        text.index("</HuntCrossleyForce>") + len("</HuntCrossleyForce>"),
    )
    force = SMOOTH if kind == "smooth" else text[start:end].replace(*ELASTIC)
    (folder / "leg.osim").write_text(text[:start] + force + text[end:])
    assert "OSIM859" in codes(folder / "id.xml")


def test_ground_that_pushes_twice(tmp_path: Path) -> None:
    folder = copy_lab("ground", tmp_path)
    assert "counts twice" in codes(folder / "id.xml")["OSIM859"]
    assert "OSIM859" not in codes(folder / "id_all.xml")
    # The foot is part of the shank, so that the force acts near that body.
    assert "OSIM849" not in codes(folder / "loads.xml")


def test_ground_once_where_the_contact_is_excluded(tmp_path: Path) -> None:
    folder = copy_lab("ground", tmp_path)
    text = (folder / "leg.osim").read_text()
    name = text.partition('<HuntCrossleyForce name="')[2].partition('"')[0]
    change(
        folder / "id.xml", ("<forces_to_exclude>Muscles<", f"<forces_to_exclude>Muscles {name}<")
    )
    assert "OSIM859" not in codes(folder / "id.xml")
    folder = copy_lab("ground", tmp_path / "off")
    change(
        folder / "leg.osim",
        (
            f'<HuntCrossleyForce name="{name}">',
            f'<HuntCrossleyForce name="{name}"><appliesForce>false</appliesForce>',
        ),
    )
    assert "OSIM859" not in codes(folder / "id.xml")


def test_loads_of_another_body_and_contacts_of_the_foot(tmp_path: Path) -> None:
    folder = copy_lab("ground", tmp_path)
    change(folder / "loads.xml", ("<applied_to_body>shank<", "<applied_to_body>pelvis<"))
    assert "OSIM859" not in codes(folder / "id.xml")
    assert "OSIM849" in codes(folder / "loads.xml")


@pytest.mark.parametrize("unit", [0.001, 1.0, 1000.0])
def test_loads_in_kilonewtons(tmp_path: Path, unit: float) -> None:
    folder = copy_lab("ground", tmp_path)
    rewrite_table(folder / "grf.mot", unit, slice(1, 4))
    found = codes(folder / "loads.xml")
    assert ("OSIM858" in found) == (unit == 0.001)


@pytest.mark.parametrize(
    ("factor", "said"),
    [(1.0, ""), (0.1, "cm"), (0.001, "m"), (10.0, "")],
    ids=["mm", "cm", "m", "too large"],
)
def test_units_of_markers_beside_the_model(tmp_path: Path, factor: float, said: str) -> None:
    """Numbers in cm or m in a file that says mm are reported; no unit explains other factors."""
    folder = copy_lab("sides", tmp_path)
    assert "\tmm\t" in (folder / "walk.trc").read_text()
    rewrite_table(folder / "walk.trc", factor, slice(2, None))
    found = codes(folder / "ik.xml")
    assert ("OSIM857" in found) == bool(said)
    if said:
        assert found["OSIM857"].endswith(f"are the numbers in {said}?")


def test_sides_that_are_not_swapped(tmp_path: Path) -> None:
    """Rows outside of the time range of the tool, and markers at 0 0 0, are ignored."""
    folder = copy_lab("sides", tmp_path)
    assert "OSIM856" not in codes(folder / "ik.xml")
    assert "OSIM856" not in codes(folder)


def test_sides_that_are_swapped(tmp_path: Path) -> None:
    folder = copy_lab("sides", tmp_path)
    text = (folder / "walk.trc").read_text()
    assert "RASI" in text
    text = text.replace("RASI", "XASI").replace("LASI", "RASI").replace("XASI", "LASI")
    (folder / "walk.trc").write_text(text)
    assert "RASI" in codes(folder / "ik.xml")["OSIM856"]


@pytest.mark.parametrize("times", ["0 1", "0.517 0.517", "-1 2"])
def test_a_static_trial_of_one_frame(tmp_path: Path, times: str) -> None:
    folder = copy_lab("one_frame", tmp_path)
    change(folder / "scale.xml", ("<time_range> 0 1<", f"<time_range>{times}<"))
    report = osimlite.validate(folder / "scale.xml")
    (error,) = [finding for finding in report.errors if finding.code == "OSIM85312"]
    assert times == "0.517 0.517" or "add a copy of the row" in error.message
    with pytest.raises(osimlite.OsimliteError) as refusal:
        osimlite.run(folder / "scale.xml", folder / "out", check=False)
    assert "add a copy of the row" in str(refusal.value)


PATHS = ["/jointset/{0}/{1}/value", "{0}/{1}/value", "/jointset/{0}/{1}"]


@pytest.mark.parametrize("label", PATHS)
def test_motions_by_paths_are_a_warning(tmp_path: Path, label: str) -> None:
    folder = copy_lab("paths", tmp_path)
    text = (folder / "walk.mot").read_text()
    for joint, name in (("root", "pelvis_tilt"), ("root", "pelvis_tx"), ("root", "pelvis_ty"), ("hip", "hip_flexion"),
                        ("knee", "knee_angle")):  # fmt: skip
        text = text.replace(f"/jointset/{joint}/{name}/value", label.format(joint, name))
    (folder / "walk.mot").write_text(text)
    report = osimlite.validate(folder / "id.xml")
    assert not report.errors
    assert any(
        finding.code == "OSIM842" and "by paths" in finding.message for finding in report.findings
    )


def test_a_trial_check_names_ground_that_pushes_twice(tmp_path: Path) -> None:
    folder = copy_lab("ground", tmp_path)
    done = run("check-trial", ".", folder=folder)
    assert "OSIM859" in done.out


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ("0,5 1,0", "0.5 1.0"),
        ("0 1,25", "0 1.25"),
        ("0,5 1,0 2", None),
    ],
)
def test_decimal_commas_of_a_time_range(tmp_path: Path, times: str, expected: str | None) -> None:
    folder = copy_lab("paths", tmp_path)
    before, _, rest = (folder / "id.xml").read_text().partition("<time_range>")
    after = rest.partition("</time_range>")[2]
    (folder / "id.xml").write_text(f"{before}<time_range>{times}</time_range>{after}")
    report = osimlite.validate(folder / "id.xml")
    assert "OSIM205" not in report.codes
    (finding,) = [finding for finding in report if finding.code in ("OSIM201", "OSIM202")]
    assert finding.suggestion == expected


@pytest.mark.parametrize("tag", ["on", "active"])
def test_a_task_that_is_off_must_name_a_coordinate(tmp_path: Path, tag: str) -> None:
    """OpenSim 4.6 looks up the name and the coordinate of each task, also of those that are off."""
    folder = copy_lab("locked", tmp_path)
    task = '<CMC_Joint name="hip_flexion"><on>true</on><weight>1</weight><active>true'
    off = task.replace(f"<{tag}>true", f"<{tag}>false")
    text = (folder / "t.xml").read_text()
    assert task in text
    (folder / "t.xml").write_text(text.replace(task, off.replace("hip_flexion", "hip_flexon")))
    assert "'hip_flexon'" in codes(folder / "t.xml")["OSIM831"]
    with pytest.raises(osimlite.OsimliteError, match="there is no coordinate 'hip_flexon'"):
        osimlite.run(folder / "cmc.xml", folder / "out", check=False)
    (folder / "t.xml").write_text(text.replace(task, off))
    assert "OSIM831" not in codes(folder / "t.xml")
