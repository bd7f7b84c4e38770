"""The version of the program: what ``pip show`` says, written where no package metadata is needed."""

VERSION = "0.1.0"
