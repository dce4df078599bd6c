# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Sensor data in the sensors' frames, at their stamps.

From topics or from a bag. Only ``live_sensors`` depends on ROS. This code depends on neither viser
nor a browser.
"""
