"""The labs, experiments of the textbook: each prints numbers and a law, and draws a picture."""
