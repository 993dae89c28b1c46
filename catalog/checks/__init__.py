"""The checks of `motionary.catalog.verify`: each takes an opened catalog and says what it found."""
