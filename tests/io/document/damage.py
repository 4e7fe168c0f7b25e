"""Random damage to model files, as files get damaged by accident or with bad intent."""

from __future__ import annotations

import re
from random import Random

TOKENS = (
    b"<!--", b"-->", b"<![CDATA[", b"]]>", b"<?xml version='1.0'?>", b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"&", b"&b;",
    b"&#0;", b"&#x110000;", b"<", b">", b'"', b"'", b"/>", b"</objects>", b"<objects>", b"<defaults>", b"\x00", b"\xff",
    b"\xef\xbb\xbf", b"\xe2\x82", b"::", b" xmlns:a='b' ", b"<a:b/>", b" file='model.osim' ", b" name='' ", b"1e999",
    b"nan", b"-", b"<<<<<<< HEAD\n", b"=======\n", b">>>>>>> theirs\n", b"../../..", b"/", b"\r\n", b"\xc2\x85",
    b"<Model/>", b"<Body name='ground'/>", b"<components><components>", b"9" * 400, b"\xf0\x9f\xa6\xb4",
)  # fmt: skip
VERSIONS = (b"", b"0", b"-1", b"10500", b"10600", b"10900", b"10901", b"20000", b"20302", b"30000", b"30501", b"30507",
            b"30515", b"30517", b"40000", b"40500", b"40600", b"50000", b"4.6", b"9" * 5000, b"\xd9\xa3")  # fmt: skip
_TAG = re.compile(rb"</?[A-Za-z_:]+")
_ELEMENT = re.compile(rb"<([A-Za-z_0-9]+)[^<>]*>[^<>]*</\1>")
_WORD = re.compile(rb"(?<=>)[^<>\s]+")


def damaged(data: bytes, random: Random) -> bytes:
    """Return a file with one to three random damages."""
    for _ in range(random.choice((1, 1, 2, 3))):
        data = random.choice(WAYS)(data, random)
    return data


def _places(data: bytes, random: Random, longest: int = 400) -> tuple[int, int]:
    start = random.randrange(len(data) + 1)
    return start, min(len(data), start + random.randrange(1, longest))


def _truncate(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data) + 1)]


def _headless(data: bytes, random: Random) -> bytes:
    return data[random.randrange(min(len(data), 400) + 1) :]


def _change_bytes(data: bytes, random: Random) -> bytes:
    mutable = bytearray(data)
    for _ in range(random.choice((1, 1, 4, 32))):
        if mutable:
            mutable[random.randrange(len(mutable))] = random.randrange(256)
    return bytes(mutable)


def _cut(data: bytes, random: Random) -> bytes:
    start, end = _places(data, random, random.choice((2, 40, 4000)))
    return data[:start] + data[end:]


def _repeat(data: bytes, random: Random) -> bytes:
    start, end = _places(data, random)
    return data[:end] + data[start:end] * random.choice((1, 1, 3, 50)) + data[end:]


def _insert(data: bytes, random: Random) -> bytes:
    place = random.randrange(len(data) + 1)
    return data[:place] + random.choice(TOKENS) + data[place:]


def _rename_tag(data: bytes, random: Random) -> bytes:
    tags = list(_TAG.finditer(data))
    if not tags:
        return data
    old, new = random.choice(tags), random.choice(tags)
    return data[: old.start()] + new[0] + data[old.end() :]


def _rename_everywhere(data: bytes, random: Random) -> bytes:
    tags = [match[0].strip(b"</") for match in _TAG.finditer(data)]
    if not tags:
        return data
    old, new = random.choice(tags), random.choice(tags)
    return re.sub(rb"(</?)" + re.escape(old) + rb"(?=[\s/>])", rb"\1" + new, data)


def _move_element(data: bytes, random: Random) -> bytes:
    elements = list(_ELEMENT.finditer(data))
    if not elements:
        return data
    one, other = random.choice(elements), random.choice(elements)
    return data[: other.end()] + one[0] + data[other.end() :]


def _drop_element(data: bytes, random: Random) -> bytes:
    elements = list(_ELEMENT.finditer(data))
    if not elements:
        return data
    one = random.choice(elements)
    return data[: one.start()] + data[one.end() :]


def _change_word(data: bytes, random: Random) -> bytes:
    words = list(_WORD.finditer(data))
    if not words:
        return data
    old, new = (
        random.choice(words),
        random.choice((*TOKENS[-6:], b"abc", b"", random.choice(words)[0])),
    )
    return data[: old.start()] + new + data[old.end() :]


def _change_version(data: bytes, random: Random) -> bytes:
    version = random.choice(VERSIONS)
    return re.sub(rb'Version="[^"]*"', lambda _: b'Version="' + version + b'"', data, count=1)


def _nest(data: bytes, random: Random) -> bytes:
    place = data.find(b"<objects>") + 9
    depth = random.choice((10, 300, 20_000))
    return data[:place] + b"<Body><components>" * depth + data[place:]


def _recode(data: bytes, random: Random) -> bytes:
    coding = random.choice(("utf-16", "utf-32", "utf-16-be", "cp500"))
    return data.decode("utf-8", "replace").encode(coding, "replace")


# All kinds of damage.
WAYS = (
    _truncate, _headless, _change_bytes, _cut, _repeat, _insert, _rename_tag, _rename_everywhere, _move_element,
    _drop_element, _change_word, _change_version, _nest, _recode,
)  # fmt: skip
