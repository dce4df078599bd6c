"""The rows of the benchmark, a file for each group of them."""
