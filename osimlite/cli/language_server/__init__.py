"""Language server for model files: findings, descriptions and completions for editors."""
