"""Check settings of a project, suppressions in comments, and baselines."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.document.source import Source
from osimlite.lint import Config, Severity, validate
from osimlite.lint.baseline import subtract_baseline, write_baseline
from osimlite.lint.cache import make_key
from osimlite.lint.registry import all_rules
from osimlite.lint.settings import Settings, load_settings

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures" / "lint"

_spec = importlib.util.spec_from_file_location("trials", Path(__file__).with_name("trials.py"))
assert _spec is not None and _spec.loader is not None
trials = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(trials)

TEXT = """\
<OpenSimDocument Version="40600">
<Model name="m">
<gravity>0 -9806 0</gravity>
<foo/>
</Model>
</OpenSimDocument>
"""


def test_settings_come_from_the_nearest_file(tmp_path):
    (tmp_path / "pyproject.toml").write_text(
        '[tool.osimlite]\nignore = ["OSIM7"]\nmesh-paths = ["shapes"]\nfail-on = "warning"\n'
        '[tool.osimlite.severity]\nstrange-gravity = "info"\n'
        '[tool.osimlite.per-file-ignores]\n"old/*.osim" = ["structure"]\n'
    )
    (tmp_path / "old" / "deep").mkdir(parents=True)
    result = load_settings(tmp_path / "old" / "deep")
    assert result.file == tmp_path / "pyproject.toml" and result.fail_on is Severity.WARNING
    old = result.config_for(tmp_path / "old" / "x.osim", Config(ignore=("OSIM505",)))
    assert old.ignore == ("OSIM7", "structure", "OSIM505")
    assert old.mesh_paths == (str(tmp_path / "shapes"),)
    assert result.config_for(tmp_path / "x.osim", Config()).ignore == ("OSIM7",)
    report = validate(
        Source(TEXT.encode()), config=result.config_for(tmp_path / "x.osim", Config())
    )
    assert [(f.code, f.severity.value) for f in report] == [
        ("OSIM505", "info"),
        ("OSIM101", "error"),
    ]


def test_thresholds_of_a_project_move_what_is_found(tmp_path):
    (tmp_path / "pyproject.toml").write_text(
        "[tool.osimlite.thresholds]\nlargest-gravity = 10000\n"
    )
    config = load_settings(tmp_path).config_for(tmp_path / "x.osim", Config())
    assert dict(config.thresholds) == {"largest-gravity": 10000}
    assert validate(Source(TEXT.encode()), config=config).codes == {"OSIM101": 1}
    own = load_settings(tmp_path).config_for(
        tmp_path / "x.osim", Config(thresholds={"largest-gravity": 5})
    )
    assert validate(Source(TEXT.encode()), config=own).codes == {"OSIM505": 1, "OSIM101": 1}
    assert make_key("x.osim", config) != make_key("x.osim", own) != make_key("x.osim", Config())


@pytest.mark.parametrize(
    "rule", [rule for rule in all_rules() if rule.thresholds], ids=lambda rule: rule.code
)
def test_each_threshold_moves_the_findings_of_its_rule(rule):
    """Extreme values of each threshold change the findings in the fixtures of its rule."""
    fixtures = [
        path
        for kind in ("osim", "trial")
        for path in sorted((FIXTURES / rule.code).glob(f"*-*.{kind}"))
    ]
    for threshold in rule.thresholds:
        seen = set()
        for moved in (
            {},
            {threshold.name: 0},
            {threshold.name: threshold.default / 100},
            {threshold.name: 1e300},
        ):
            config = Config((rule.code,), thresholds=moved)
            reports = [
                trials.checked_trial(path.read_text(), rule, config)
                if path.suffix == ".trial"
                else validate(path, config=config)
                for path in fixtures
            ]
            seen.add(
                tuple((finding.line, finding.severity) for report in reports for finding in report)
            )
        assert len(seen) > 1, f"{threshold.name} of {rule.code} changes nothing"


def test_a_finding_is_kept_for_one_version_and_for_the_classes_of_one_day(tmp_path):
    declared = tmp_path / "classes.json"
    declared.write_text("{}")
    before = make_key("x.osim", Config(classes=(str(declared),)))
    declared.write_text('{"classes": {}}')
    keys = {
        before,
        make_key("x.osim", Config(classes=(str(declared),))),
        make_key("x.osim", Config()),
    }
    assert len({*keys, make_key("x.osim", Config(target_version="4.5"))}) == 4


def test_an_osimlite_toml_goes_first_and_a_pyproject_without_a_section_is_passed_over(tmp_path):
    (tmp_path / "osimlite.toml").write_text('select = ["references"]\n')
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "pyproject.toml").write_text("[project]\nname = 'x'\n")
    assert load_settings(tmp_path / "sub").select == ("references",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("selct = []", "unknown setting 'selct'; did you mean 'select'?"),
        ('select = ["OSIM999"]', "no rule has the code or name 'OSIM999'"),
        ('select = "OSIM1"', "'select' must be a list of texts"),
        ('severity = "error"', "'severity' must be a table"),
        (
            '[severity]\nOSIM101 = "fatal"',
            "a severity is one of error, warning and info, not 'fatal'",
        ),
        ("select = [", "this is not valid TOML"),
        (
            "[thresholds]\nlargest-gravty = 3",
            "no rule has a threshold 'largest-gravty'; did you mean 'largest-",
        ),
        (
            '[thresholds]\nlargest-gravity = "3"',
            "the threshold 'largest-gravity' must be a number, 0 or more, not '3'",
        ),
        ("[thresholds]\nlargest-gravity = true", "must be a number"),
        ("[thresholds]\nlargest-gravity = -1", "must be a number, 0 or more, not '-1'"),
        ("thresholds = 3", "'thresholds' must be a table"),
    ],
)
def test_a_setting_that_makes_no_sense_names_its_file(text, words, tmp_path):
    (tmp_path / "osimlite.toml").write_text(text)
    with pytest.raises(OsimliteError) as caught:
        load_settings(tmp_path)
    assert words in str(caught.value) and "osimlite.toml" in str(caught.value)


def test_a_comment_ignores_on_its_line_on_the_next_element_or_everywhere():
    assert validate(Source(TEXT.encode())).codes == {"OSIM505": 1, "OSIM101": 1}
    line = TEXT.replace("<foo/>", "<foo/> <!-- osimlite: ignore OSIM101 -->")
    assert validate(Source(line.encode())).codes == {"OSIM505": 1}
    above = TEXT.replace("<gravity>", "<!-- osimlite: ignore strange-gravity -->\n<gravity>")
    assert validate(Source(above.encode())).codes == {"OSIM101": 1}
    everywhere = "<!-- osimlite: ignore OSIM1, OSIM505 -->\n" + TEXT
    assert not validate(Source(everywhere.encode())).findings


def test_a_comment_that_ignores_nothing_is_found():
    text = TEXT.replace("<foo/>", "<foo/> <!-- osimlite: ignore OSIM101 OSIM203 -->")
    (finding,) = validate(Source(text.encode()), ignore="OSIM505").findings
    assert finding.code == "OSIM010" and "'OSIM203'" in finding.message and finding.line == 4
    # Whether a suppression is unused is unknown if its rule did not run.
    assert not validate(Source(text.encode()), ignore="OSIM505,OSIM203").findings


def test_a_baseline_hides_what_it_knows_and_no_more(tmp_path):
    path = tmp_path / "baseline.json"
    old = validate(Source(TEXT.encode(), "m.osim"))
    assert write_baseline(path, old) == 2
    moved = Source(TEXT.replace("<foo/>", "\n\n<foo/><foo/>").encode(), "m.osim")
    # One finding counts all elements with an unknown name, so that one more changes its message.
    assert validate(moved).codes == {"OSIM505": 1, "OSIM101": 1}
    assert subtract_baseline(path, validate(moved)).codes == {"OSIM101": 1}
    assert json.loads(path.read_text())["format"] == 1


def test_a_baseline_holds_wherever_the_project_lies(tmp_path, monkeypatch):
    mesh = "<Mesh><mesh_file>a.vtp</mesh_file></Mesh>"
    model = TEXT.replace(
        "<foo/>", f"<Ground><attached_geometry>{mesh}</attached_geometry></Ground>"
    )
    for place in ("here", "there"):
        (tmp_path / place).mkdir()
        monkeypatch.chdir(tmp_path / place)
        geometry = str(tmp_path / place / "Bones")
        Path("m.osim").write_text(model)
        report = validate("m.osim", config=Config(("OSIM701",), mesh_paths=(geometry,)))
        assert geometry in report.findings[0].message
        if place == "here":
            write_baseline(tmp_path / "baseline.json", report)
    assert not subtract_baseline(tmp_path / "baseline.json", report).findings


def test_a_file_that_is_no_baseline_is_refused(tmp_path):
    with pytest.raises(OsimliteError, match=r"absent.json: cannot read the file: no such file"):
        subtract_baseline(tmp_path / "absent.json", validate(Source(TEXT.encode())))
    (tmp_path / "odd.json").write_text("[1]")
    with pytest.raises(OsimliteError, match="this is not a baseline"):
        subtract_baseline(tmp_path / "odd.json", validate(Source(TEXT.encode())))


def test_mesh_folders_of_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bones = tmp_path / "bones"
    bones.mkdir()
    (bones / "femur.vtp").touch()
    model = osimlite.Model(name="leg")
    body = model.add(osimlite.Body(name="femur", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    body.attach(osimlite.Mesh(mesh_file="femur.vtp"))
    file = tmp_path / "leg.osim"
    osimlite.write(model, file)
    assert osimlite.validate(file, select="OSIM701").codes == {"OSIM701": 1}
    monkeypatch.setenv("OSIMLITE_GEOMETRY", str(bones))
    assert not osimlite.validate(file, select="OSIM701").findings
    assert Settings().config_for(file, Config()).mesh_paths == (str(bones),)
