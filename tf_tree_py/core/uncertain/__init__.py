"""
What is asked of poses that may be off: covariances along a path, budgets, predictions.

Plain lookups know nothing of it, and where covariances are kept is ``edges``' business.
"""
