# What the scripts share: where things are, how to speak, and how to enter and leave a ROS world.
# For bash; sourced, never run.
# shellcheck shell=bash disable=SC2034

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
workspace=$(realpath -m "${TF_TREE_PY_WORKSPACE:-$repository/.workspace}")
path_variables=(PATH PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH)
# The last is the wheels' own: their Python restarts itself, libraries on the path, unless it is set.
marks_of_ros=(ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION _ROS_WHEELS_BOOTSTRAP_COMPLETE)

# Steps send their output to a log; what a person is to read goes to the terminal all the same.
exec 3>&2
say() { printf 'tf_tree_py: %s\n' "$*" >&3; }

# made_here: was the workspace made by this clone, and where it lies now? Paths are built into it, so
# a copy, or one that was moved, leads to the old place.
made_here() {
  local stamp=$workspace/install/tf_tree_py/.stamp venv=$workspace/venv/.stamp
  [[ -e $stamp && $(<"$stamp") == *" $repository "* ]] || return
  [[ ! -e $venv || $(<"$venv") == "$workspace "* ]]
}

# domain_id_of PID: a DDS domain that no other program is likely to be in. Those from 101 to 214 have
# ports that Linux may have given to somebody else.
domain_id_of() { echo $((1 + $1 % 100)); }

# leave FOLDER NAME...: drop the entries that lie in FOLDER, and empty ones, from path variables.
leave() {
  local folder=$1 name entry kept entries
  shift
  for name; do
    kept=
    IFS=: read -ra entries <<<"${!name-}"
    for entry in "${entries[@]}"; do
      case $entry in "$folder" | "$folder"/* | '') ;; *) kept+=${kept:+:}$entry ;; esac
    done
    export "$name=$kept"
  done
}

# prepend NAME FOLDER: put FOLDER first in the path variable NAME.
prepend() { export "$1=$2${!1:+:${!1}}"; }

jazzy_is_sourced() { [[ ${ROS_DISTRO-} == jazzy ]] && python3 -c 'import rclpy' 2>/dev/null; }

# Leave the worlds this shell may be in, and enter the one that tf_tree_py is built upon: a sourced
# ROS 2 Jazzy as it is, else the wheels in the workspace's venv. Sets `world` to its Python.
enter_ros() {
  local prefix prefixes
  leave "$repository/.workspace" "${path_variables[@]}"
  leave "$workspace" "${path_variables[@]}"
  if jazzy_is_sourced; then
    world=$(command -v python3)
    return
  fi
  # Another distribution, or another clone of this repository: its modules are not for our Python.
  IFS=: read -ra prefixes <<<"${AMENT_PREFIX_PATH-}"
  for prefix in "${prefixes[@]}"; do leave "$prefix" "${path_variables[@]:1}"; done
  unset "${marks_of_ros[@]}"
  world=$workspace/venv/bin/python
  prepend PATH "$workspace/venv/bin"
  prepend AMENT_PREFIX_PATH "$workspace/venv"
  prepend CMAKE_PREFIX_PATH "$workspace/venv"
}

# first_python CONDITION CANDIDATE...: the first that runs (a pyenv shim may exist and yet fail)
# and for which the Python expression holds.
first_python() {
  local condition=$1 candidate
  shift
  for candidate; do
    "$candidate" -c "
import os, sys, sysconfig
cpython = sys.implementation.name == 'cpython'
version = sys.version_info[:2]
headers = os.path.exists(os.path.join(sysconfig.get_paths()['include'], 'Python.h'))
if not (cpython and $condition):
    sys.exit(1)
print(sys.executable)" 2>/dev/null && return
  done
  return 1
}

pyenv_versions=${PYENV_ROOT:-${HOME-}/.pyenv}/versions
