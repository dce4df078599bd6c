"""
How many examples hypothesis tries: some in every run, ten times as many in a thorough one.

``scripts/test --hypothesis-profile thorough`` makes it one. Examples are drawn anew in every
run, so what a few of them miss is found by and by. Where the same tests run a second time, in
another environment, a few are enough to meet what is different there.
"""

from hypothesis import HealthCheck, settings

settings.register_profile('ordinary', deadline=None, max_examples=20, print_blob=True,
                          suppress_health_check=[HealthCheck.too_slow])
settings.register_profile('thorough', settings.get_profile('ordinary'), max_examples=200)
settings.register_profile('brief', settings.get_profile('ordinary'), max_examples=4)
settings.load_profile('ordinary')


def examples(times: float, **options) -> settings:
    """Return settings with so many times the examples that the profile gives to a test."""
    return settings(max_examples=round(times * settings().max_examples), **options)
