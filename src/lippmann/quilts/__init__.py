"""Quilts of views, their files, and the weaving of views into native pixels."""
