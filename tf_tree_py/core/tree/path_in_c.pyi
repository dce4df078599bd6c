# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

from ..edges.protocol import History
from ..geometry.chain import PoseTuple

Parts = tuple[History | PoseTuple, ...]

def pose_at(down: Parts, up: Parts, stamp: int, /) -> PoseTuple | None: ...
def use(static: type, moving: type, revision: int, /) -> None: ...
