"""A run's settings: the configuration file, the environment, the command line.

Later wins: the stages' defaults, `[stage]` tables of a TOML file, `MOTIONARY_STAGE__FIELD` in the
environment, options of the command line. Every field is described in `motionary.pipeline.config`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError
from pydantic_settings import (
    BaseSettings,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
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


class _Settings(BaseSettings):
    model_config = SettingsConfigDict(
        env_prefix="MOTIONARY_", env_nested_delimiter="__", extra="forbid", frozen=True
    )

    read: ReadConfig = Field(default_factory=ReadConfig)
    features: FeatureConfig = Field(default_factory=FeatureConfig)
    distances: DistanceConfig = Field(default_factory=DistanceConfig)
    clusters: ClusterConfig = Field(default_factory=ClusterConfig)
    alignment: AlignmentConfig = Field(default_factory=AlignmentConfig)
    conventions: dict[str, dict[str, str]] = Field(default_factory=dict)


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
    if file is not None and not file.is_file():
        raise SettingsError(f"no configuration file {file}")

    class FromFile(_Settings):
        @classmethod
        def settings_customise_sources(
            cls,
            settings_cls: type[BaseSettings],
            init_settings: PydanticBaseSettingsSource,
            env_settings: PydanticBaseSettingsSource,
            dotenv_settings: PydanticBaseSettingsSource,
            file_secret_settings: PydanticBaseSettingsSource,
        ) -> tuple[PydanticBaseSettingsSource, ...]:
            toml = TomlConfigSettingsSource(settings_cls, toml_file=file)
            return (init_settings, env_settings, toml) if file else (init_settings, env_settings)

    given: dict[str, Any] = {stage: dict(fields) for stage, fields in options.items()}
    try:
        settings = FromFile(**given)
        own = tuple(Convention(name, joints) for name, joints in settings.conventions.items())
    except ValidationError as error:
        raise SettingsError("; ".join(_explained(one) for one in error.errors())) from None
    except ValueError as error:  # a convention with wrong joints, or TOML that cannot be parsed
        raise SettingsError(f"{file or 'settings'}: {error}") from None
    features = FeatureConfig(**{**_fields(settings.features), "conventions": own})
    return PipelineConfig(settings.read, features, settings.distances, settings.clusters, settings.alignment)


def _fields(config: FeatureConfig) -> dict[str, Any]:
    return {name: getattr(config, name) for name in config.__dataclass_fields__}


def _explained(error: Any) -> str:
    place = ".".join(map(str, error["loc"]))
    if error["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        return f"there is no setting {place}"
    return f"setting {place}: {error['msg'].removeprefix('Value error, ')}"
