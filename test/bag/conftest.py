"""How hypothesis runs here, and that nothing runs without rosbags."""

from importlib.util import find_spec

from hypothesis import HealthCheck, settings

settings.register_profile('bags', deadline=None, max_examples=60, print_blob=True,
                          suppress_health_check=[HealthCheck.too_slow])
settings.load_profile('bags')

collect_ignore_glob = [] if find_spec('rosbags') else ['test_*.py']
