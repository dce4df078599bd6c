# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Entry points of the tools."""

from tf_tree_py.command.starting import starter

tf_archive = starter(f'{__package__}.tf_archive')
tf_audit = starter(f'{__package__}.tf_audit')
tf_calibrate = starter(f'{__package__}.tf_calibrate')
tf_doctor = starter(f'{__package__}.tf_doctor')
tf_echo = starter(f'{__package__}.tf_echo')
tf_export = starter(f'{__package__}.tf_export')
tf_frames = starter(f'{__package__}.tf_frames')
tf_monitor = starter(f'{__package__}.tf_monitor')
tf_record = starter(f'{__package__}.tf_record')
view_frames = starter(f'{__package__}.tf_frames', 'view_frames')
