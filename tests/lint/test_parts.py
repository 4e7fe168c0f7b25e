"""Check that a measurement is repeated only where something that it depends on has changed."""

from __future__ import annotations

import json
import re

import pytest

import osimlite.lint.measuring
from osimlite.io.document.source import Source
from osimlite.lint import Config, measures, validate
from osimlite.lint.many import check_files
from osimlite.lint.subject import Subject

FILES = [
    "OSIM631/fail-02-in-default-and-beyond.osim",
    "OSIM632/fail-02-two-coordinates.osim",
    "OSIM633/fail-02-far-side-and-middle.osim",
    "OSIM634/fail-02-ends-and-rests.osim",
    "OSIM635/fail-02-slack-and-tense.osim",
    "OSIM636/fail-02-short-and-long.osim",
]
OWNER = re.compile(
    r"<(PathSpring|Thelen2003Muscle|Millard2012EquilibriumMuscle|DeGrooteFregly2016Muscle) .*?</\1>",
    re.S,
)


@pytest.fixture
def asked(monkeypatch):
    """Return a list that grows by the measured paths at each measurement."""
    results: list[list[str]] = []
    own = osimlite.lint.measuring.measure_model

    def measured(model, **given):
        result = own(model, **given)
        results.append(
            sorted(set(result.swept) - set(given["earlier"][1].swept if given["earlier"] else ()))
        )
        return result

    monkeypatch.setattr(osimlite.lint.measuring, "measure_model", measured)
    measures.remembered.clear()
    return results


@pytest.fixture(params=FILES)
def text(request, fixtures):
    return (fixtures / "lint" / request.param).read_text()


def told(text):
    return [(item.code, item.message) for item in validate(Source(text.encode()), select="OSIM63")]


def fresh(text):
    measures.remembered.clear()
    return told(text)


def test_a_text_is_measured_once(text, asked):
    assert told(text) == told(text) != []
    assert len(asked) == 1


def test_what_no_path_depends_on_is_not_asked(text, asked):
    result = told(text)
    changed = re.sub(r"(<ContactSphere .*?<radius>)0.05", r"\g<1>0.06", text, flags=re.S)
    assert changed != text
    assert told(changed) == result
    assert len(asked) == 1


def test_a_path_that_changed_is_measured_alone_and_the_others_are_as_they_were(text, asked):
    alone = 0
    for match in OWNER.finditer(text):
        element = match[0]
        for old in re.findall(r">(0\.\d+|-0\.\d+)", element)[:3]:
            changed = text.replace(
                element, element.replace(f">{old}", f">{1.1 * float(old):.5f}", 1)
            )
            told(text)
            once, paths = told(changed), asked[-1]
            assert once == fresh(changed)
            assert len(paths) == 1 or paths == asked[-1]
            alone += len(paths) == 1
    assert alone


def test_a_joint_that_changed_is_one_of_all_paths(fixtures, asked):
    text = (fixtures / "lint" / "OSIM636" / "fail-02-short-and-long.osim").read_text()
    told(text)
    changed = text.replace("<range>-2.1 0</range>", "<range>-1.1 0</range>")
    assert told(changed) == fresh(changed) != told(text)
    assert all(len(paths) == len(OWNER.findall(text)) for paths in asked)


def test_a_path_more_or_less(asked, fixtures):
    text = (fixtures / "lint" / "OSIM636" / "fail-02-short-and-long.osim").read_text()
    every = told(text)
    (first, *_) = (match[0] for match in OWNER.finditer(text))
    less = text.replace(first, "")
    without = told(less)
    assert len(asked) == 1 and len(without) < len(every)
    assert told(text) == every
    assert len(asked) == 1
    assert fresh(less) == without
    assert told(text) == every
    assert len(asked) == 3 and len(asked[-1]) == 1


def test_it_is_kept_beside_the_findings(fixtures, tmp_path, asked, monkeypatch, findings_cache):
    text = (fixtures / "lint" / "OSIM632" / "fail-02-two-coordinates.osim").read_text()
    path = tmp_path / "m.osim"
    path.write_text(text)
    result = check_files([str(path)], Config()).codes
    (kept,) = findings_cache.glob("*/measured/*.json")
    subject = Subject(osimlite.io.document.survey.survey_source(Source(text.encode())))
    own = measures.digest_parts(subject)
    measures.remembered.clear()
    known = measures.recall_measures(own, kept.parents[1])
    assert known.measures == measures_of(text)
    for wrong in (
        "{}",
        "[]",
        "x",
        json.dumps([{}, [1]]),
        kept.read_text().replace('"poses"', "5")[:-9],
    ):
        measures.remembered.clear()
        kept.write_text(wrong)
        assert measures.recall_measures(own, kept.parents[1]) is None
    measures.remembered.clear()
    assert check_files([str(path)], Config()).codes == result


def measures_of(text):
    measures.remembered.clear()
    subject = Subject(osimlite.io.document.survey.survey_source(Source(text.encode())))
    assert not subject.measure()
    return measures.get_measures(subject)


def test_a_model_whose_classes_stand_elsewhere_has_no_parts(fixtures):
    text = (fixtures / "lint" / "OSIM632" / "fail-02-two-coordinates.osim").read_text()
    subject = Subject(
        osimlite.io.document.survey.survey_source(Source(text.encode())),
        Config(classes=("x.toml",)),
    )
    assert measures.digest_parts(subject) is None
