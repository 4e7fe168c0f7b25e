"""Which comments OpenSim wrote itself.

OpenSim prints the description of a property before each property, and drops every comment it reads.
We keep what a person wrote and drop what OpenSim would print anyway. Its sentences are known by
their digests only.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path

DIGEST_SIZE = 6

_COMMENT = re.compile(rb"<!--([^-]*+(?:-[^-]++)*+)-->")


@lru_cache(maxsize=4096)
def is_generated(text: str) -> bool:
    """Whether a comment is one that some version of OpenSim prints by itself."""
    return digest(text) in _known()


def all_generated(data: bytes) -> bool:
    """Whether a UTF-8 text has no comment but OpenSim's own; half of the nodes of such a text are comments."""
    return all(is_generated(text.decode(errors="replace")) for text in set(_COMMENT.findall(data)))


def digest(text: str) -> bytes:
    """Digest of a comment, white space and digits aside."""
    # The library behind it takes longer to load than most files do to read, and many have no
    # comments.
    from hashlib import blake2b

    plain = re.sub(r"[\s\d]+", " ", text).strip()
    return blake2b(plain.encode(), digest_size=DIGEST_SIZE).digest()


@cache
def _known() -> frozenset[bytes]:
    data = Path(__file__).with_name("generated_comments.bin").read_bytes()
    return frozenset(data[i : i + DIGEST_SIZE] for i in range(0, len(data), DIGEST_SIZE))
