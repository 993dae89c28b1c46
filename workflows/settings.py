"""A run's settings: the configuration file, the environment, the command line.

Later wins: the stages' defaults, `[stage]` tables of a TOML file, `MOTIONARY_STAGE__FIELD` in the
environment, options of the command line. Every field is described in `motionary.pipeline.config`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import Field, ValidationError
from pydantic_settings import (
    BaseSettings,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
)

from motionary.pipeline.canonical import Convention
from motionary.pipeline.config import (
    AlignmentConfig,
    ClusterConfig,
    DistanceConfig,
    FeatureConfig,
    PipelineConfig,
    ReadConfig,
)
from motionary.workflows.errors import UserError

PAPER: dict[str, Any] = {
    "features": {"kind": "paper"},
    "clusters": {"primary": "complete", "cut": "strip"},
}
"""What `--paper` sets: the paper's pose, complete linkage, the widest threshold strip."""


class SettingsError(UserError):
    """A setting is not valid; the message names it."""


class EnvironmentSettings(BaseSettings):
    """Settings that the environment may override, as `MOTIONARY_TABLE__FIELD`."""

    model_config = SettingsConfigDict(
        env_prefix="MOTIONARY_", env_nested_delimiter="__", extra="forbid", frozen=True
    )


class _Settings(EnvironmentSettings):
    read: ReadConfig = Field(default_factory=ReadConfig)
    features: FeatureConfig = Field(default_factory=FeatureConfig)
    distances: DistanceConfig = Field(default_factory=DistanceConfig)
    clusters: ClusterConfig = Field(default_factory=ClusterConfig)
    alignment: AlignmentConfig = Field(default_factory=AlignmentConfig)
    conventions: dict[str, dict[str, str]] = Field(default_factory=dict)


_LARGEST, _LONGEST_LINE = 2**17, 1000
"""Of a configuration: a long key with many dots takes tomllib memory by the square of their number."""

_Model = TypeVar("_Model", bound=EnvironmentSettings)


def load_settings(file: Path | None, options: Mapping[str, Mapping[str, Any]]) -> PipelineConfig:
    """Join a configuration file, the environment and the command line.

    Parameters
    ----------
    file : Path, optional
        TOML: `[read]`, `[features]`, `[distances]`, `[clusters]`, `[alignment]` and, for a rig that no
        built-in joint-name convention fits, `[conventions.NAME]` with the 19 canonical joints.
    options : mapping of stage to fields
        Of the command line.

    Raises
    ------
    SettingsError
        The file is missing or not TOML, or a setting is unknown or out of range.
    """
    return stage_settings(read_toml(file) if file else {}, options, file)


def stage_settings(
    tables: Mapping[str, Any], options: Mapping[str, Mapping[str, Any]], file: Path | None = None
) -> PipelineConfig:
    """Join the tables of a configuration file, the environment and the command line.

    Raises
    ------
    SettingsError
        A setting is unknown or out of range; the message begins with `file` where that is given.
    """
    settings = joined(_Settings, tables, options, file)
    try:
        own = tuple(Convention(name, joints) for name, joints in settings.conventions.items())
    except ValueError as error:  # wrong joints
        raise SettingsError(f"{file or 'settings'}: {error}") from None
    features = FeatureConfig(**{**_fields(settings.features), "conventions": own})
    try:
        return PipelineConfig(
            settings.read, features, settings.distances, settings.clusters, settings.alignment
        )
    except ValueError as error:  # settings of two stages that do not go together
        raise SettingsError(f"{file or 'settings'}: {error}") from None


def read_toml(file: Path) -> dict[str, Any]:
    """Read the tables of a configuration file.

    Raises
    ------
    SettingsError
        The file is missing, cannot be read or is not TOML.
    """
    try:
        text = file.read_text(encoding="utf-8")
        if len(text) > _LARGEST or max(map(len, text.splitlines()), default=0) > _LONGEST_LINE:
            limits = f"{_LARGEST:,} characters or has a line of more than {_LONGEST_LINE:,}"
            raise SettingsError(f"{file} is no configuration: it is longer than {limits}; give a TOML file")
        return tomllib.loads(text)
    except (FileNotFoundError, IsADirectoryError):
        raise SettingsError(f"no configuration file {file}") from None
    except OSError as error:
        raise SettingsError(f"configuration file {file} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # not TOML, or not UTF-8, or brackets within brackets
        raise SettingsError(f"{file}: {error}") from None


def joined(
    model: type[_Model],
    tables: Mapping[str, Any],
    options: Mapping[str, Mapping[str, Any]],
    file: Path | None = None,
) -> _Model:
    """Fill a model of settings; later wins: the tables of a file, the environment, options.

    Raises
    ------
    SettingsError
        A setting is unknown or out of range; the message begins with `file` where that is given.
    """

    class Joined(model):  # type: ignore[misc, valid-type]
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: PydanticBaseSettingsSource,
            env_settings: PydanticBaseSettingsSource,
            dotenv_settings: PydanticBaseSettingsSource,
            file_secret_settings: PydanticBaseSettingsSource,
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            return (init_settings, env_settings, InitSettingsSource(settings_cls, dict(tables)))

    given: dict[str, Any] = {stage: dict(fields) for stage, fields in options.items()}
    place = f"{file}: " if file else ""
    try:
        return Joined(**given)
    except ValidationError as error:
        told = [_explained(one) for one in error.errors()]
        more = f"; and {len(told) - 8} more" if len(told) > 8 else ""
        raise SettingsError(place + "; ".join(told[:8]) + more) from None
    except ValueError as error:  # a variable of the environment that cannot be parsed
        raise SettingsError(f"{place or 'settings: '}{error}") from None


def _fields(config: FeatureConfig) -> dict[str, Any]:
    return {name: getattr(config, name) for name in config.__dataclass_fields__}


def _explained(error: Any) -> str:
    place = ".".join(map(str, error["loc"]))
    if error["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        return f"there is no setting {place}"
    if error["type"] == "missing":
        return f"setting {place} is missing"
    return f"setting {place}: {error['msg'].removeprefix('Value error, ')}"
