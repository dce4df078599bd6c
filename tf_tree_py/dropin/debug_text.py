# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The reasons of tf2's ``can_transform``, in its exact words, because some programs parse them."""

from tf_tree_py.core.errors import (
    ConnectivityException,
    FutureExtrapolationException,
    LookupException,
    PastExtrapolationException,
    TransformException,
)


def tf2_text(error: TransformException) -> str:
    """Return the text of tf2's ``can_transform`` for an error; this package's if tf2 has none."""
    if isinstance(error, LookupException):
        return (f'Invalid frame ID {error.describe()}'
                .replace('lookupTransform', 'canTransform')
                .replace(' does not exist', ' - frame does not exist'))
    if isinstance(error, ConnectivityException):
        return (f"Could not find a connection between '{error.target_frame}' and "
                f"'{error.source_frame}' because they are not part of the same tree."
                'Tf has two or more unconnected trees.')
    if isinstance(error, FutureExtrapolationException) and error.latest is not None:
        return _extrapolation(error, 'the future', 'latest', error.latest)
    if isinstance(error, PastExtrapolationException) and error.oldest is not None:
        return _extrapolation(error, 'the past', 'earliest', error.oldest)
    return error.describe()


def _extrapolation(error: FutureExtrapolationException | PastExtrapolationException,
                   where: str, which: str, stamp: int) -> str:
    assert error.requested is not None
    return (f'Lookup would require extrapolation into {where}.  Requested time '
            f'{_seconds(error.requested)} but the {which} data is at time {_seconds(stamp)}, when '
            f'looking up transform from frame [{error.source_frame}] to frame '
            f'[{error.target_frame}]')


def _seconds(stamp: int) -> str:
    return f'{stamp / 1e9:.6f}'
