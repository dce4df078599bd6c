# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Writes the sources of tf2_msgs: ``python -m tf_tree_py.interfaces.generating FOLDER``.

It calls the generators of the wheels in one process, and only those whose results rclpy loads
with Fast DDS: ``ament_cmake`` would run all of them, each in a process of its own.
"""

from pathlib import Path
import sys

PACKAGE = 'tf2_msgs'

DEFINITIONS = Path(__file__).with_name(PACKAGE)
"""The folder of the definitions: ``msg``, ``srv``, ``action``, and package.xml."""

TYPE_SUPPORTS = ('rosidl_typesupport_fastrtps_c', 'rosidl_typesupport_introspection_c')
"""What rmw_fastrtps_cpp asks for: the one to serialise, the other to describe types to DDS."""


def definitions() -> list[Path]:
    """Return the files of the definitions, relative to ``DEFINITIONS``."""
    return sorted(path.relative_to(DEFINITIONS)
                  for subfolder in ('msg', 'srv', 'action')
                  for path in (DEFINITIONS / subfolder).glob(f'*.{subfolder}'))


def generate(output: Path) -> None:
    """
    Write C, C++ and Python into ``output/<generator>/tf2_msgs``.

    Type descriptions and IDL go into ``output`` itself. The generators need folders of their own,
    because some of their files have the same names.

    :param output: the folder, an absolute path.
    """
    # Only the wheels have these.
    from rosidl_adapter import convert_to_idl
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    for file in definitions():
        convert_to_idl(DEFINITIONS, PACKAGE, file, output)
    interfaces = [f'{output}:{file.with_suffix(".idl")}' for file in definitions()]
    of_dependencies = [str(Path(sys.prefix, 'share'))]
    described = HashTypeDescription('').generate_type_hashes(
        PACKAGE, interfaces, of_dependencies, output)
    GenerateC('').generate(PACKAGE, interfaces, [], output / 'c' / PACKAGE, described)
    fastrtps, introspection = TYPE_SUPPORTS
    for folder, generator in {
            fastrtps: GenerateFastRTPSCTypesupport(''),
            introspection: GenerateIntrospectionCTypesupport(''),
            'dispatch': GenerateCTypesupport('', typesupport_implementations=[*TYPE_SUPPORTS]),
            'py': GeneratePython('', typesupport_implementations=['rosidl_typesupport_c']),
    }.items():
        generator.generate(PACKAGE, interfaces, [], output / folder / PACKAGE)


if __name__ == '__main__':
    generate(Path(sys.argv[1]).absolute())
