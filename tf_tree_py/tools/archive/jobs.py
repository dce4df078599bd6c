# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The jobs for one bag, in a process on any machine."""

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
import json
from pathlib import Path
import time
from typing import Any, NamedTuple

from tf_tree_py.bag import BagError
from tf_tree_py.command.endings import Cannot
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.health.doctor import Doctor
from tf_tree_py.health.measures.thresholds import Thresholds

from .bags import local_copy
from .page import report_page
from ..doctor_report import judged
from ..export.formats import FORMATS
from ..export.plan import Plan
from ..recorded_tree import RecordedTree

FINE, WARNING, ERROR = 'fine', 'warning', 'error'
BROKEN = 'broken'
"""The bag yields no result, and another try would not help."""
LOST = 'lost'
"""The bag did not cause the failure, and another try may help."""

Row = dict[str, Any]


class Result(NamedTuple):
    """
    The result of a job for one bag.

    :ivar row: of the table; at least ``outcome`` and ``reason``.
    :ivar files: by their suffixes; the first is the one for people.
    """

    row: Row
    files: dict[str, bytes]


Job = Callable[[Path, str], Result]
"""Takes the path of a bag, and its name."""


@dataclass(frozen=True)
class ReportJob:
    """Run the doctor."""

    limits: Thresholds

    def __call__(self, path: Path, name: str) -> Result:
        """Return the report about a bag."""
        doctor = Doctor(self.limits)
        arguments = Namespace(bag=path, tf_topic=None, tf_static_topic=None)
        with RecordedTree(arguments, [doctor], self.limits.cache_time) as source:
            source.watch(None)
            report, findings = judged(source, doctor)
        report['source'] = name
        codes = dict.fromkeys(finding.code for finding in findings)
        row = {
            'outcome': ERROR if report['errors'] else
            (WARNING if report['warnings'] or report['damage'] else FINE),
            'reason': '; '.join(report['damage']),
            **{key: report[key] for key in ('errors', 'warnings', 'notes')},
            'codes': ' '.join(codes),
            **{key: report[key] for key in ('transforms', 'frames', 'watched_s')},
        }
        return Result(row, {'.html': report_page(report),
                            '.json': json.dumps(report, indent=2, allow_nan=False).encode()})


@dataclass(frozen=True)
class ExportJob:
    """Write a trajectory."""

    plan: Plan
    form: str

    def __call__(self, path: Path, name: str) -> Result:
        """Return the trajectory of the plan in a bag."""
        taken, recording = self.plan.of(path)
        row = {
            'outcome': WARNING if recording.oddities else FINE,
            'reason': '; '.join(map(str, recording.oddities[:3])),
            'poses': len(taken.stamps),
            'outside': taken.outside,
            'oddities': len(recording.oddities),
            'first_s': format_stamp(int(taken.stamps.min())),
            'last_s': format_stamp(int(taken.stamps.max())),
        }
        return Result(row, {f'.{self.form}': FORMATS[self.form](taken)})


def done(job: Job, path: str) -> Result:
    """Run a job on a bag; any error is reported in the row."""
    begin = time.monotonic()
    try:
        with local_copy(path) as here:
            try:
                result = job(here, path)
            except (BagError, TransformException, Cannot) as error:
                result = failed(BROKEN, str(error).replace(str(here), path))
    except Exception as error:  # noqa: B902 - the other bags have to be read
        result = failed(LOST, f'{type(error).__name__}: {error}')
    result.row['took_s'] = round(time.monotonic() - begin, 3)
    return result


def failed(outcome: str, reason: str) -> Result:
    """Return the result for a bag without any files."""
    return Result({'outcome': outcome, 'reason': ' '.join(reason.split())}, {})
