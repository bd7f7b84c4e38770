"""Parts that the commands share: console output, options, and the parsing of values."""
