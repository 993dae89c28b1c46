"""Tables on disk, snapshots, SQL and views over a library of motions."""

from motionary.catalog.query import Catalog, CatalogError

__all__ = ["Catalog", "CatalogError"]
