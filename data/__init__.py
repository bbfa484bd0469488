"""How the sample faces are obtained and built; no third-party mesh is in the repository."""
