"""What a person looks at: pages and charts of a catalog."""
