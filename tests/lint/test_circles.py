"""Check frames that depend on themselves, in cycles of any structure."""

from hypothesis import given
from hypothesis import strategies as st

from osimlite.io.document.source import Source
from osimlite.lint import validate


@given(st.lists(st.integers(0, 7), min_size=1, max_size=8))
def test_frames_on_a_circle_are_those_that_lead_back_to_themselves(below: list[int]) -> None:
    """The origin of each frame is a station on another frame, or on ground."""
    parts = "".join(
        f'<StationDefinedFrame name="f{k}"><socket_origin_point>/s{k}</socket_origin_point></StationDefinedFrame>'
        f'<Station name="s{k}"><socket_parent_frame>/{f"f{to}" if to < len(below) else "ground"}</socket_parent_frame>'
        "</Station>"
        for k, to in enumerate(below)
    )
    text = f'<OpenSimDocument Version="40600"><Model name="m"><components>{parts}</components></Model></OpenSimDocument>'
    expected = set()
    for start in range(len(below)):
        here = start
        for _ in below:
            here = below[here] if here < len(below) else here
            if here == start:
                expected.add(f"f{start}")
    result = validate(Source(text.encode()), select="OSIM411").findings
    assert {finding.message.split("'")[1] for finding in result} == expected
