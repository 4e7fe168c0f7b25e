"""Compare the linter's verdict on unusual forms of XML with OpenSim's parser.

There must be an error for each form that OpenSim rejects.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from osimlite.lint import validate

pytestmark = pytest.mark.oracle

HEAD = b'<?xml version="1.0" encoding="UTF-8"?>\n'
ROOT = b'<OpenSimDocument Version="40600"><Model name="x"><gravity>0 -5 0</gravity></Model></OpenSimDocument>\n'
# Byte order mark of UTF-8.
MARK = b"\xef\xbb\xbf"


def changed(old: bytes, new: bytes) -> bytes:
    assert old in HEAD + ROOT
    return (HEAD + ROOT).replace(old, new)


ENTITY = '[<!ENTITY nm "5">]>'
DOCTYPES = {
    "an entity": f"<!DOCTYPE a {ENTITY}",
    "a comment before it": f"<!-- <OpenSimDocument --><!DOCTYPE a {ENTITY}",
    "an instruction before it": f"<?a <!DOCTYPE b>?><!DOCTYPE a {ENTITY}",
    "an end in its name": f"<!DOCTYPE a SYSTEM '&gt;>' {ENTITY}",
    "an end and a tag in its name": "<!DOCTYPE a SYSTEM '><Model/>'>",
    "a comment inside": '<!DOCTYPE a [<!-- ] --> <!ENTITY nm "5">]>',
    "an instruction inside": '<!DOCTYPE a [<?a ]?> <!ENTITY nm "5">]>',
    "an entity of its own kind": '<!DOCTYPE a [<!ENTITY % nm SYSTEM "file:///dev/zero"> %nm;]>',
    "an attribute for all": '<!DOCTYPE a [<!ATTLIST BodySet file CDATA "set.xml">]>',
    "entities of entities": "<!DOCTYPE a [<!ENTITY a0 '0123456789'>"
    + "".join(f"<!ENTITY a{n + 1} '{f'&a{n};' * 10}'>" for n in range(9))
    + "]>",
}

# Forms that OpenSim accepts.
TAKEN = {
    "plain": HEAD + ROOT,
    "no declaration": ROOT,
    "blank lines first": b"\n\n" + HEAD + ROOT,
    "comment first": b"<!-- a -->\n" + HEAD + ROOT,
    "two declarations": HEAD + HEAD + ROOT,
    "declaration last": ROOT + HEAD,
    "mark": MARK + HEAD + ROOT,
    "mark and blank line": MARK + b"\n" + HEAD + ROOT,
    "two marks": MARK + MARK + HEAD + ROOT,
    "mark between elements": changed(b"<gravity>", MARK + b"<gravity>"),
    "form feed": changed(b"0 -5 0", b"0\x0c-5 0"),
    "bare ampersand": changed(b"<gravity>", b"<credits>a & b</credits><gravity>"),
    "bracket in an attribute": changed(b'"x"', b'"x>y"'),
    "single quotes": changed(b'"x"', b"'x'"),
    "blanks in a start tag": changed(b"<gravity>", b"<gravity\n >"),
    "comment before a value": changed(b"0 -5 0", b"<!-- a -->0 -5 0"),
    "comment after a value": changed(b"0 -5 0", b"0 -5 0<!-- a -->"),
    "a value as CDATA": changed(b"0 -5 0", b"<![CDATA[0 -5 0]]>"),
    "hyphens in a comment": changed(b"<gravity>", b"<!-- a -- b --><gravity>"),
    "character reference": changed(b'"x"', b'"x&#65;y"'),
    "doctype": HEAD + b'<!DOCTYPE OpenSimDocument SYSTEM "a.dtd">\n' + ROOT,
    "doctype with public name": HEAD
    + b"<!DOCTYPE OpenSimDocument PUBLIC '-//a' \"it's\">\n"
    + ROOT,
    "doctype that declares nothing": HEAD + b"<!-- < -->\n<!DOCTYPE OpenSimDocument [ ]>\n" + ROOT,
    "schema": changed(
        b"<OpenSimDocument ",
        b'<OpenSimDocument xmlns:xsi="http://a" xsi:noNamespaceSchemaLocation="b" ',
    ),
}
# Forms that OpenSim rejects.
REFUSED = {
    "text first": b"hello\n" + HEAD + ROOT,
    "text between": HEAD + b"hello\n" + ROOT,
    "text last": HEAD + ROOT + b"bye\n",
    "reference between": HEAD + b"&amp;" + ROOT,
    "mark after the declaration": HEAD + MARK + ROOT,
    "mark after a blank line": b"\n" + MARK + HEAD + ROOT,
    "mark last": HEAD + ROOT + MARK,
    "UTF-16": (HEAD + ROOT).decode().encode("utf-16"),
    "blank in a closing tag": changed(b"</gravity>", b"</gravity >"),
    "closing tag over two lines": changed(b"</Model>", b"</Model\n>"),
    "comment in a value": changed(b"0 -5 0", b"0 <!-- a -->-5 0"),
    "instruction in a value": changed(b"0 -5 0", b"0 <?a b?>-5 0"),
    "CDATA in a value": changed(b"0 -5 0", b"0 <![CDATA[-5]]> 0"),
    "two roots": HEAD + ROOT + ROOT,
    "cut off": (HEAD + ROOT)[:-30],
    "another case": changed(b"</gravity>", b"</Gravity>"),
    "doctype with declarations": HEAD + b"<!DOCTYPE OpenSimDocument [<!ELEMENT a ANY>]>\n" + ROOT,
    **{
        f"doctype with {words}": HEAD + doctype.encode() + ROOT
        for words, doctype in DOCTYPES.items()
    },
    "entity of elsewhere": HEAD
    + b'<!DOCTYPE a SYSTEM "a.dtd">'
    + ROOT.replace(b"0 -5", b"&nm;0 -5"),
    "entity of an unread entity": HEAD + b"<!DOCTYPE a [%a;]>" + ROOT.replace(b"0 -5", b"&nm;0 -5"),
    "white space in a name": changed(b'"x"', b'"x\ty"'),
}
OTHERWISE = {
    # OpenSim accepts these texts but reads something else than they say.
    "no-break space": changed(b"0 -5", b"0\xc2\xa0-5"),
    "minus sign": changed(b"-5", b"\xe2\x88\x925"),
    "full-width digit": changed(b"-5", b"-\xef\xbc\x95"),
    "mark in a value": changed(b"0 -5", MARK + b"0 -5"),
}


@pytest.mark.parametrize("case", DOCTYPES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1"])
def test_nothing_that_a_doctype_declares_is_read(case, encoding, tmp_path):
    """Entities are used in an attribute too, where a parser inserts their text without a message."""
    text = (DOCTYPES[case] + ROOT.decode()).replace('"x"', '"&nm;&a9;"').replace("0 -5", "&nm;0 -5")
    path = tmp_path / "text.osim"
    path.write_bytes(text.encode(encoding))
    report = validate(path)
    assert [finding.code for finding in report.errors if finding.code != "OSIM002"] == ["OSIM001"]
    assert "DOCTYPE" in str(report)


def taken(path: Path) -> list[float] | None:
    """Return the gravity that OpenSim reads, or None if it rejects the file."""
    opensim = pytest.importorskip("opensim")
    opensim.Logger.setLevelString("Off")
    try:
        model = opensim.Model(str(path))
        model.initSystem()
    except RuntimeError:
        return None
    return [model.getGravity().get(n) for n in range(3)]


@pytest.mark.parametrize("case", [*TAKEN, *REFUSED, *OTHERWISE])
def test_there_is_an_error_where_opensim_does_not_read_what_is_written(case, tmp_path):
    path = tmp_path / "text.osim"
    path.write_bytes((TAKEN | REFUSED | OTHERWISE)[case])
    report = validate(path)
    assert bool(report.errors) == (taken(path) != [0.0, -5.0, 0.0]), str(report)
    assert bool(report.errors) == (case not in TAKEN)
