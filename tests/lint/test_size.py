"""Check large models with many faults: the work grows linearly, and the number of messages is limited."""

from __future__ import annotations

import sys

import pytest

from osimlite.base.text import MAX_MESSAGE_LENGTH
from osimlite.io.document.source import Source
from osimlite.lint.engine import check_source
from tests.suite import choose

BODY = "<Body name='{}' {}><mass>1</mass>{}</Body>"


def model(bodies: str, rest: str = "") -> str:
    return (
        "<OpenSimDocument Version='40600'><Model name='m'>"
        f"<BodySet name='bodyset'><objects>{bodies}</objects></BodySet>{rest}</Model></OpenSimDocument>"
    )


def frames(count: int, first: str) -> str:
    links = (first, *(f"/componentset/f{k}" for k in range(count - 1)))
    items = "".join(
        f"<PhysicalOffsetFrame name='f{k}'><socket_parent>{link}</socket_parent></PhysicalOffsetFrame>"
        for k, link in enumerate(links)
    )
    return model(
        BODY.format("b", "", ""),
        f"<ComponentSet name='componentset'><objects>{items}</objects></ComponentSet>",
    )


def circle(count: int) -> str:
    links = (
        f"<StationDefinedFrame name='f{k}'><socket_origin_point>/s{k}</socket_origin_point></StationDefinedFrame>"
        f"<Station name='s{k}'><socket_parent_frame>/f{(k + 1) % count}</socket_parent_frame></Station>"
        for k in range(count)
    )
    return model(BODY.format("b", "", ""), f"<components>{''.join(links)}</components>")


LOST = "<Station name='s{0}'><socket_parent_frame>/bodyset/b{0}</socket_parent_frame></Station>"
LIMIT = "<CoordinateLimitForce name='s{0}'><coordinate>x{0}</coordinate></CoordinateLimitForce>"
# Functions that return a model with n faults of one kind.
KINDS = {
    "bodies of one name": lambda n: model(BODY.format("b", "", "") * n),
    "attributes": lambda n: model(BODY.format("b", " ".join(f"a{k}='1'" for k in range(n)), "")),
    "elements": lambda n: model(BODY.format("b", "", "<foo>1</foo>" * n)),
    "classes": lambda n: model("<Foo name='x'/>" * n),
    "circle of frames": circle,
    "sockets to nothing": lambda n: model(
        "", f"<components>{''.join(LOST.format(k) for k in range(n))}</components>"
    ),
    "frames of frames": lambda n: frames(n, "/bodyset/b"),
    "frames in a circle": lambda n: frames(n, f"/componentset/f{n - 1}"),
    "names of nothing": lambda n: model(
        BODY.format("b", "", ""),
        f"<ForceSet name='forceset'><objects>{''.join(LIMIT.format(k) for k in range(n))}</objects></ForceSet>",
    ),
}


def calls(text: str) -> int:
    """Return the number of function calls and generator steps that checking a text takes."""
    count = 0

    def note(*_: object) -> None:
        nonlocal count
        count += 1

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        check_source(Source.from_text(text))
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.parametrize("kind", KINDS)
def test_four_times_as_much_is_four_times_the_work(kind):
    calls(KINDS[kind](10))
    # A body costs ten times as much as the other elements.
    count = choose(15 if kind == "bodies of one name" else 50, 100)
    small, large = calls(KINDS[kind](count)), calls(KINDS[kind](4 * count))
    assert large < 5.5 * small


@pytest.mark.parametrize(
    "value", ["1" * choose(1_000_000, 5_000_000), "1 " * 100_000, "x" * 100_000]
)
def test_long_values_are_cut(value):
    report = check_source(
        Source.from_text(model(BODY.format("b", "", "").replace(">1<", f">{value}<")))
    )
    assert report.findings
    assert all(len(finding.message) <= MAX_MESSAGE_LENGTH for finding in report.findings)
