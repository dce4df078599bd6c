# Copyright 2026 tf_tree_py maintainers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""What is done with one bag, in a process that may be anywhere."""

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
import json
from pathlib import Path
import time
from typing import Any, NamedTuple

from tf_tree_py.bag import BagError
from tf_tree_py.core.doctor import Doctor
from tf_tree_py.core.errors import TransformException
from tf_tree_py.core.stamp import format_stamp
from tf_tree_py.core.vitals.limits import Limits

from .bags import local_copy
from .page import report_page
from ..doctor_report import judged
from ..endings import Cannot
from ..export.formats import FORMATS
from ..export.plan import Plan
from ..recording import Recording

FINE, WARNING, ERROR = 'fine', 'warning', 'error'
BROKEN = 'broken'
"""Nothing can be had of the bag, and another try would not help."""
LOST = 'lost'
"""What happened has nothing to do with the bag, and another try may help."""

Row = dict[str, Any]


class Result(NamedTuple):
    """
    What came of a bag.

    :ivar row: of the table; at least ``outcome`` and ``reason``.
    :ivar files: by their suffixes; the first is what people look at.
    """

    row: Row
    files: dict[str, bytes]


Job = Callable[[Path, str], Result]
"""Takes where a bag can be read, and what it is called."""


@dataclass(frozen=True)
class ReportJob:
    """Ask the doctor."""

    limits: Limits

    def __call__(self, path: Path, name: str) -> Result:
        """Return what is wrong with a bag."""
        doctor = Doctor(self.limits)
        arguments = Namespace(bag=path, tf_topic=None, tf_static_topic=None)
        with Recording(arguments, [doctor], self.limits.cache_time) as source:
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
        """Return what a bag has of the plan."""
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
    """Do a job with a bag; whatever goes wrong stands in the row."""
    begin = time.monotonic()
    try:
        with local_copy(path) as here:
            try:
                result = job(here, path)
            except (BagError, TransformException, Cannot) as error:
                result = failed(BROKEN, str(error).replace(str(here), path))
    except Exception as error:  # noqa: B902 - the other bags are to be read
        result = failed(LOST, f'{type(error).__name__}: {error}')
    result.row['took_s'] = round(time.monotonic() - begin, 3)
    return result


def failed(outcome: str, reason: str) -> Result:
    """Return the row of a bag of which there is nothing."""
    return Result({'outcome': outcome, 'reason': ' '.join(reason.split())}, {})
