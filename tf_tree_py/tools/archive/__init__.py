"""
Many bags at once, on dask: a task, a row and some files for each.

What is found out of one bag is the doctor's, or the export's.
"""
