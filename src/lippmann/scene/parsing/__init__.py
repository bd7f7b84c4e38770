"""Tools that several scene readers share: files, tokens, triangulation, texture maps."""
