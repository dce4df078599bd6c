# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sensor data from topics or from a bag, in the sensors' frames and at their stamps.

Only ``live_sensors`` depends on ROS. This code depends on neither viser nor a browser.
"""
