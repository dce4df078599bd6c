"""The textbook's experiments: each prints numbers, draws a picture and states the law."""
