"""Tables on disk, snapshots, SQL and views over a library of motions."""

from motionary.catalog.errors import CatalogError
from motionary.catalog.query import Catalog

__all__ = ["Catalog", "CatalogError"]
