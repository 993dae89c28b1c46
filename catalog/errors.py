"""What a catalog cannot do for the person who asks."""


class CatalogError(Exception):
    """A catalog cannot answer; the message says why and what to do."""
