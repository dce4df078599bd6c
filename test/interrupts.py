# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""A keyboard interrupt at each place at which one can come in a folder of the package."""

import gc
import sys


class Interrupt:
    """
    Raise a ``KeyboardInterrupt`` at one of the calls in this block, and suppress it.

    CPython looks for signals when a function begins, and after a call of a function in C. In those
    of a lock, the lock would stay held: there, none comes here.

    :ivar left: how many calls were still to come before that; negative if it was raised.
    """

    def __init__(self, number, folder):
        self.left, self.folder = number, folder

    def __enter__(self):
        gc.disable()  # what runs in a collection is interrupted without effect
        sys.setprofile(self.profile)
        return self

    def __exit__(self, kind, *_):
        sys.setprofile(None)
        gc.enable()
        return kind is not None and issubclass(kind, KeyboardInterrupt)

    def profile(self, frame, event, _):
        caller = frame.f_back if event == 'call' else frame
        if (event in ('call', 'c_return') and self.folder in caller.f_code.co_filename
                and not {'__enter__', '__exit__'} & {frame.f_code.co_name, caller.f_code.co_name}):
            self.left -= 1
            if self.left == -1:
                sys.setprofile(None)
                raise KeyboardInterrupt
