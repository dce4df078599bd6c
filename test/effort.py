# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The number of examples that hypothesis tries, ten times as many in a thorough run.

``scripts/test --hypothesis-profile thorough`` selects a thorough run. Every run draws new
examples, so repeated runs eventually find what a few examples miss. Where the same tests run a
second time in another environment, a few examples are enough to find its differences.
"""

from hypothesis import HealthCheck, settings

settings.register_profile('ordinary', deadline=None, max_examples=20, print_blob=True,
                          suppress_health_check=[HealthCheck.too_slow])
settings.register_profile('thorough', settings.get_profile('ordinary'), max_examples=200)
settings.register_profile('brief', settings.get_profile('ordinary'), max_examples=4)
settings.load_profile('ordinary')


def examples(times: float, **options) -> settings:
    """Return settings with a multiple of the number of examples of the profile."""
    return settings(max_examples=round(times * settings().max_examples), **options)
