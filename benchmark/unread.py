# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pages of ``tf_view`` that never read what the server sends."""

import time
from typing import Any

_PATIENCE_S = 60.0


def unread_pages(port: int, count: int) -> list[Any]:
    """Return the connections of some pages; a server that is starting is waited for."""
    import viser
    from websockets.sync.client import connect
    from websockets.typing import Origin, Subprotocol
    pages: list[Any] = []
    end = time.monotonic() + _PATIENCE_S
    while len(pages) < count and time.monotonic() < end:
        try:
            pages.append(connect(
                f'ws://127.0.0.1:{port}', max_queue=1, origin=Origin(f'http://127.0.0.1:{port}'),
                subprotocols=[Subprotocol(f'viser-v{viser.__version__}')]))
        except OSError:
            time.sleep(0.5)
    return pages
