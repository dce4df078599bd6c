# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The profiles of hypothesis: the same examples in every run, or new ones in an exploration.

``scripts/test`` tries the same examples every time: they depend on the source of the test alone,
and no database of earlier failures adds to them. Where the same tests run a second time in another
environment, a few examples find its differences (``brief``). ``--hypothesis-profile thorough``
tries ten times as many. ``scripts/test --explore`` draws new ones, from the seed that it prints.
"""

from contextlib import suppress

from hypothesis import HealthCheck, Phase, settings

settings.register_profile('ordinary', deadline=None, max_examples=20, derandomize=True,
                          database=None, print_blob=True,
                          suppress_health_check=[HealthCheck.too_slow])
settings.register_profile('thorough', settings.get_profile('ordinary'), max_examples=200)
settings.register_profile('brief', settings.get_profile('ordinary'), max_examples=4)
settings.register_profile('explore', settings.get_profile('ordinary'), max_examples=100,
                          derandomize=False)
# The shortest example of a failure does not matter.
settings.register_profile('mutants', settings.get_profile('ordinary'),
                          phases=[Phase.explicit, Phase.generate])
settings.load_profile('ordinary')


def _draw_no_constants_of_modules() -> None:
    """
    Let hypothesis draw no constants that it found in the source of imported modules.

    They depend on the modules that other tests have imported, and change with every edit. No
    setting turns them off; versions of hypothesis before 6.131 do not have them.
    """
    with suppress(ImportError, AttributeError):
        from hypothesis.internal.conjecture import providers

        constants = providers._local_constants
        providers._get_local_constants = lambda: constants


_draw_no_constants_of_modules()


def examples(times: float, **options) -> settings:
    """Return settings with a multiple of the number of examples of the profile."""
    return settings(max_examples=round(times * settings().max_examples), **options)
