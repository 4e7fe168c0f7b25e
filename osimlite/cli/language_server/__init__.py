"""A language server for model files: what the linter and the schema know, shown in an editor while somebody types."""
