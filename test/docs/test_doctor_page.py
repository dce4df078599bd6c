# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""The page of the doctor has every code, as in the doctor's list."""

import importlib.util
from pathlib import Path

from tf_tree_py.health.checks.catalogue import CODES

SCRIPT = Path(__file__).parents[2] / 'docs' / 'figures' / 'doctor_codes.py'


def test_page_has_every_code_as_the_catalogue_has_it():
    spec = importlib.util.spec_from_file_location('doctor_codes', SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    written = script.PAGE.read_text().partition(script.BEGIN)[2].partition(script.END)[0]
    assert written.strip() == script.sections().strip(), f'run python docs/figures/{SCRIPT.name}'


def test_failure_modes_of_the_textbook_come_first():
    from_textbook = [code.textbook for code in CODES.values()]
    assert from_textbook == sorted(from_textbook, reverse=True)


def test_symptoms_are_codes_too():
    assert all(code.explains <= CODES.keys() for code in CODES.values())
