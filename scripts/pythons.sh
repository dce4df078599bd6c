# Finds a Python of the machine that suits an environment. Shared by scripts/setup and scripts/package.
# For bash; sourced after lib.sh, never run. It uses `uv`, `workspace`
# and `world` of the script that sources it.
# shellcheck shell=bash disable=SC2154

pyenv_versions=${PYENV_ROOT:-${HOME-}/.pyenv}/versions

# first_python CONDITION CANDIDATE...: print the first one that runs (a pyenv shim may exist and
# still fail) and for which the Python expression is true.
first_python() {
  local condition=$1 candidate
  shift
  for candidate; do
    "$candidate" -c "
import os, sys, sysconfig
cpython = sys.implementation.name == 'cpython'
free_threaded = bool(sysconfig.get_config_var('Py_GIL_DISABLED'))
version = sys.version_info[:2]
headers = os.path.exists(os.path.join(sysconfig.get_paths()['include'], 'Python.h'))
if not (cpython and $condition):
    sys.exit(1)
print(sys.executable)" 2>/dev/null && return
  done
  return 1
}

# The Pythons that the wheels of ROS 2 are for; the first one is that of Ubuntu 24.04.
pythons_of_wheels=(3.12 3.13 3.14 3.11 3.10)

# installed_python_of_wheels: print $PYTHON, or else the first of these that is installed with its
# headers.
installed_python_of_wheels() {
  local plain suits PATH=${PATH#"$workspace/venv/bin:"}
  if [[ ${PYTHON-} ]]; then
    first_python "'%d.%d' % version in '${pythons_of_wheels[*]}'.split() and headers" "$PYTHON"
    return
  fi
  for plain in "${pythons_of_wheels[@]}"; do
    suits="version == (${plain/./, }) and headers and not free_threaded"
    first_python "$suits" "python$plain" python3 "$pyenv_versions/$plain".*/bin/python && return
    # A pyenv shim makes it print an error.
    first_python "$suits" "$("$uv" python find "$plain" 2>/dev/null)" && return
  done
  return 1
}

# python_of_wheels: print the same; download one if there is none.
python_of_wheels() {
  installed_python_of_wheels && return
  [[ ! ${PYTHON-} ]] && "$uv" python install 3.12 && "$uv" python find --managed-python 3.12
}

# Any Python except that of the wheels shows that core needs only its declared dependencies; the
# oldest one lacks the most. If there is no other, that one still tests core without ROS and with the
# oldest numpy.
python_of_core() {
  local PATH=${PATH#"$workspace/venv/bin:"} of_wheels
  of_wheels=$("$world" -c 'import sys; print(sys.version_info[:2])' 2>/dev/null) ||
    of_wheels='(3, 12)' # most likely
  first_python "version >= (3, 10) and version != $of_wheels" python3.10 \
    "$pyenv_versions"/3.10.*/bin/python python3 python3.{11,12,13,14} \
    "$pyenv_versions"/3.1[1234].*/bin/python ||
    first_python 'version >= (3, 10)' "$world"
}

# PyBullet has wheels for few Pythons.
python_of_arm() {
  local PATH=${PATH#"$workspace/venv/bin:"}
  first_python 'version in ((3, 10), (3, 11))' python3 python3.{11,10} \
    "$pyenv_versions"/3.1[01].*/bin/python ||
    first_python 'version == (3, 11)' "$("$uv" python find 3.11)" ||
    { "$uv" python install 3.11 && "$uv" python find --managed-python 3.11; }
}

python_of_docs() {
  local PATH=${PATH#"$workspace/venv/bin:"}
  first_python 'version >= (3, 12)' python3 python3.1{2..4} "$pyenv_versions"/3.1[234].*/bin/python ||
    first_python 'version >= (3, 12)' "$("$uv" python find 3.12)" ||
    { "$uv" python install 3.12 && "$uv" python find --managed-python 3.12; }
}

# python_of VERSION: such as 3.13, or 3.13t without the lock that lets one thread run at a time.
python_of() {
  local PATH=${PATH#"$workspace/venv/bin:"} plain=${1%t} free=False
  [[ $plain == "$1" ]] || free=True
  first_python "version == (${plain/./, }) and free_threaded == $free" "python$1" \
    "$pyenv_versions/$plain".*/bin/python ||
    "$uv" python find "$1" ||
    { "$uv" python install "$1" && "$uv" python find --managed-python "$1"; }
}
