# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

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
