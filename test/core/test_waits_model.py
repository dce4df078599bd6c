# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""No query sleeps whose result is available, or will never be."""

from effort import examples
from waits_machine import WaitsMachine

TestNobodySleepsWithoutReason = WaitsMachine.TestCase
TestNobodySleepsWithoutReason.settings = examples(10, stateful_step_count=40)
