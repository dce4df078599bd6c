"""Executables: the demo robot of five frames and its listener, static transforms, servers."""
