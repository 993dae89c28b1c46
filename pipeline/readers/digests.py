"""A digest of what a clip is read from, the same whether that lies in a folder or in a zip."""

from __future__ import annotations

import os
from collections.abc import Sequence
from hashlib import blake2b
from pathlib import Path

from motionary.pipeline.readers.errors import ReadError, is_special
from motionary.pipeline.readers.zipped import archive_of, members_of, pieces_of, stamp_of

_PIECE = 1 << 20


def digest_of(files: Sequence[str]) -> str:
    """Digest the contents of files, each with its length; empty where one cannot be opened."""
    digest = blake2b(digest_size=16)
    try:
        for file in files:
            inside = archive_of(file)
            if inside is not None:
                digest = _with_member(digest, *inside)
                continue
            if is_special(Path(file)):
                return ""
            with Path(file).open("rb") as opened:
                digest.update(os.fstat(opened.fileno()).st_size.to_bytes(8, "little"))
                while piece := opened.read(_PIECE):
                    digest.update(piece)
    except (OSError, ReadError):
        return ""
    return digest.hexdigest()


def _with_member(digest: blake2b, archive: Path, name: str) -> blake2b:
    member = members_of(archive).get(name)
    if member is None:
        raise FileNotFoundError(name)
    longer = digest.copy()
    longer.update(member.info.file_size.to_bytes(8, "little"))
    try:
        for piece in pieces_of(archive, name):
            longer.update(piece)
    except ReadError as error:
        if isinstance(error.__cause__, OSError):
            raise
        digest.update(stamp_of(archive, name))
        return digest
    return longer
