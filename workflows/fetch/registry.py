"""Which public sets there are: `public_libraries.toml` beside this module, or a file of that form."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from difflib import get_close_matches
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import pyarrow as pa
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from motionary.workflows.errors import UserError
from motionary.workflows.settings import read_toml

BUILT_IN = Path(__file__).with_name("public_libraries.toml")
LABELS = ("action", "style", "subject", "take")
"""What the name of a clip may tell; always columns of the labels file, empty where it does not."""
OWN_FILES = ("labels.csv", "SOURCE.txt")
"""What is written beside the files of a set."""
DOWNLOADS = ".fetch"
"""The hidden folder, in that of a set, where what is downloaded lies."""


class FetchError(UserError):
    """A set cannot be fetched; the message names what, where and the mend."""


def _plain_name(value: str) -> str:
    if not re.fullmatch(r"[\w-][\w.-]*", value):
        raise ValueError(f"{value!r} is no plain file name; use letters, digits, dots, - and _")
    return value


def _web_address(value: str) -> str:
    if not re.match(r"https?://[^/]", value):
        raise ValueError(f"{value!r} does not begin with http:// or https://")
    return value


def _digest(value: str) -> str:
    algorithm, _, digits = value.lower().partition(":")
    if algorithm not in ("md5", "sha1", "sha256", "sha512"):
        raise ValueError(f"{value!r} is no digest; write it as sha256:... or md5:...")
    wanted = hashlib.new(algorithm, usedforsecurity=False).digest_size * 2
    if not re.fullmatch(rf"[0-9a-f]{{{wanted}}}", digits):
        raise ValueError(f"{value!r} has not the {wanted} hexadecimal digits of {algorithm}")
    return f"{algorithm}:{digits}"


def _label_pattern(value: str) -> str:
    try:
        groups = re.compile(value).groupindex
    except re.error as error:
        raise ValueError(f"{value!r} is no regular expression: {error}") from None
    if not groups or not set(groups) <= set(LABELS):
        raise ValueError(f"{value!r} must name groups, of {', '.join(LABELS)}: write (?P<action>...)")
    return value


Text = Annotated[str, Field(min_length=1)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class SetFile(_Table):
    """A file to download.

    Parameters
    ----------
    name : str
        What it is called here.
    url : str, optional
        Where it is; None where that is not documented.
    bytes : int, optional
        Its size, where that is documented.
    digest : str, optional
        As "sha256:..." or "md5:...", where it is published.
    """

    name: Annotated[str, AfterValidator(_plain_name)]
    url: Annotated[str, AfterValidator(_web_address)] | None = None
    bytes: int | None = Field(default=None, gt=0)
    digest: Annotated[str, AfterValidator(_digest)] | None = None


class PublicSet(_Table):
    """A public set of motion capture; the registry file says what each field is."""

    name: Annotated[str, AfterValidator(_plain_name)]
    title: Text
    source: Annotated[str, AfterValidator(_web_address)]
    licence: Text
    terms: Text
    attribution: Text
    keep: tuple[Text, ...] = Field(min_length=1)
    pattern: Annotated[str, AfterValidator(_label_pattern)] | None = None
    notes: str = ""
    citations: tuple[Text, ...] = ()
    files: tuple[SetFile, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _own_names(self) -> PublicSet:
        names = [file.name for file in self.files]
        if repeated := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two files are called {repeated[0]!r}")
        return self

    def keeps(self, path: str) -> bool:
        """Tell whether a file of an archive is unpacked: it fits a pattern, in any case, and is not ours."""
        wanted = any(fnmatchcase(path.lower(), pattern.lower()) for pattern in self.keep)
        return wanted and path not in OWN_FILES

    @property
    def bytes(self) -> int | None:
        """Size of all files; None where it is not documented of each."""
        sizes = [file.bytes for file in self.files if file.bytes is not None]
        return sum(sizes) if len(sizes) == len(self.files) else None


def load_registry(file: Path | None = None) -> dict[str, PublicSet]:
    """Read the public sets by name, from the built-in registry or from a file of its form.

    Raises
    ------
    SettingsError
        The file is missing or not TOML.
    FetchError
        A field is missing, unknown or wrong; the message names file, set and field.
    """
    file = file or BUILT_IN
    return {name: _checked(name, fields, file) for name, fields in read_toml(file).items()}


def set_named(name: str, registry: Mapping[str, PublicSet]) -> PublicSet:
    """Return a set of the registry.

    Raises
    ------
    FetchError
        There is none of this name; the message names those nearest to it.
    """
    if name not in registry:
        near = get_close_matches(name, registry, cutoff=0.4) or list(registry)
        raise FetchError(f"there is no set {name!r}; did you mean {' or '.join(near)}?")
    return registry[name]


def table_of_sets(registry: Mapping[str, PublicSet]) -> pa.Table:
    """Lay the sets out as a table, a row each; no value where something is not documented."""
    rows = [
        {
            "name": one.name,
            "title": one.title,
            "files": len(one.files),
            "bytes": one.bytes,
            "digests": sum(file.digest is not None for file in one.files),
            "licence": one.licence,
            "source": one.source,
            "terms": one.terms,
            "attribution": one.attribution,
            "notes": one.notes or None,
        }
        for one in registry.values()
    ]
    texts = ("name", "title", "licence", "source", "terms", "attribution", "notes")
    columns = ("name", "title", "files", "bytes", "digests", *texts[2:])
    return pa.Table.from_pylist(
        rows, pa.schema([(one, pa.string() if one in texts else pa.int64()) for one in columns])
    )


def _checked(name: str, fields: object, file: Path) -> PublicSet:
    if not isinstance(fields, dict):
        raise FetchError(f"{file}: {name} is no table; write each set as [{name}]")
    try:
        return PublicSet(**{**fields, "name": name})
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, (name, *first["loc"])))
        raise FetchError(f"{file}: {place}: {first['msg'].removeprefix('Value error, ')}") from None
