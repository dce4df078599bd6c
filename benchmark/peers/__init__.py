"""The contestants. This file imports nothing: one of them runs in another Python."""
