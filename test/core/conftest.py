"""How hypothesis runs here: as long as an example needs, and few enough of them."""

from hypothesis import HealthCheck, settings

settings.register_profile(
    'tf_tree_py', deadline=None, max_examples=60, print_blob=True,
    suppress_health_check=[HealthCheck.too_slow])
settings.load_profile('tf_tree_py')
