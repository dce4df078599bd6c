# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What the server of the pages logs about its clients: a line a second for each, not a traceback.

Anyone who can connect can send bytes that are no request, at any rate. websockets and asyncio
would log a traceback of thirty lines for each.
"""

import asyncio
import logging
import sys
import traceback
from typing import Any

from tf_tree_py.limited_log import LimitedLog


def print_line(line: str) -> None:
    """Print a line as tf_view prints its others."""
    print(f'tf_view: {line}', file=sys.stderr, flush=True)


class RequestLogger(logging.Logger):
    """A logger for websockets' server that writes to a limited log."""

    def __init__(self, log: LimitedLog) -> None:
        """Write warnings and errors to a log."""
        super().__init__('tf_view', logging.WARNING)
        self._limited = log

    def handle(self, record: logging.LogRecord) -> None:
        """Write a record with the client's address and the error, on one line."""
        # viser adds filters to websockets' logger, which would hide all failures of this kind.
        error = record.exc_info[1] if record.exc_info else None
        if not _is_silent(error):
            client = _address_of(getattr(record, 'websocket', None))
            self._write(record.msg, record.getMessage(), client, error)

    def handle_error(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Write an error that no code of asyncio's loop has handled."""
        # The message may contain addresses in memory.
        self._write('error in the server', context['message'], '', context.get('exception'))

    def _write(self, kind: str, what: str, client: str, error: BaseException | None) -> None:
        why = '' if error is None else traceback.format_exception_only(_root_of(error))[-1].strip()
        ends = f', from {client}' if client else '', f': {why}' if why else ''
        self._limited.write(kind, client, what + ''.join(ends), why)


def _address_of(connection: Any) -> str:
    """Return the host of a client, without its port, which differs for each connection."""
    address = connection.remote_address if connection is not None else None
    return str(address[0]) if address else 'an unknown client'


def _is_silent(error: BaseException | None) -> bool:
    """Return whether a client has sent nothing, as browsers do that connect in advance."""
    root = None if error is None else _root_of(error)
    return isinstance(root, EOFError) and 'after 0 bytes' in str(root)


def _root_of(error: BaseException) -> BaseException:
    """Return the innermost cause of an error."""
    while error.__cause__ is not None:
        error = error.__cause__
    return error
