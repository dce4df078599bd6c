# Shared by the scripts: paths, messages, and entering and leaving ROS environments.
# For bash; sourced, never run.
# shellcheck shell=bash disable=SC2034

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)

# For scripts with `--distro NAME` as first option, and their children: use that ROS 2's wheels.
if [[ ${1-} == --distro ]]; then
  export TF_TREE_PY_DISTRO=${2-}
  shift 2 2>/dev/null || shift
fi
distro=${TF_TREE_PY_DISTRO-jazzy}
case $distro in
  jazzy) requirements_of_ros=ros.txt ;;
  kilted) requirements_of_ros=kilted.txt ;;
  *)
    echo "tf_tree_py: --distro is jazzy or kilted, not '$distro': PyPI has the wheels of these" >&2
    exit 2
    ;;
esac

default_workspace=$repository/.workspace
[[ $distro == jazzy ]] || default_workspace+=/$distro
workspace=$(realpath -m "${TF_TREE_PY_WORKSPACE:-$default_workspace}")
path_variables=(PATH PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH LD_LIBRARY_PATH)
# The last one belongs to the wheels: unless it is set, their Python restarts itself with the
# libraries on the path.
marks_of_ros=(ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION _ROS_WHEELS_BOOTSTRAP_COMPLETE)

# The output of steps is written to a log; messages for the user go to the terminal.
exec 3>&2
say() { printf 'tf_tree_py: %s\n' "$*" >&3; }

# made_here: was the workspace made by this clone, at its current path, for the entered ROS? It
# contains absolute paths, so a copied or moved workspace refers to the old place.
made_here() {
  local stamp=$workspace/install/tf_tree_py/.stamp
  if [[ $world == "$workspace"/* ]]; then
    stamp=$workspace/venv/setup/tf_tree_py/.stamp
    [[ -e $stamp && $(<"$workspace/venv/.stamp") == "$workspace "* ]] || return
  fi
  [[ -e $stamp && $(<"$stamp") == *" $repository "* ]]
}

# made_elsewhere: was it made by another clone, or at another path?
made_elsewhere() {
  local stamp
  for stamp in "$workspace"/{install,venv/setup}/tf_tree_py/.stamp; do
    [[ ! -e $stamp || $(<"$stamp") == *" $repository "* ]] || return 0
  done
  [[ -e $workspace/venv/.stamp && $(<"$workspace/venv/.stamp") != "$workspace "* ]]
}

# domain_id_of PID: a DDS domain that no other program is likely to use. Domains from 101 to 214 have
# ports that Linux may have assigned to other programs.
domain_id_of() { echo $((1 + $1 % 100)); }

# leave FOLDER NAME...: remove the entries in FOLDER, and empty ones, from path variables.
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

# A sourced ROS 2 is used if it is Jazzy or later (their names are in alphabetical order), unless
# the wheels of another distribution are requested.
ros_is_sourced() {
  [[ ${ROS_DISTRO-} && ! $ROS_DISTRO < jazzy && ${TF_TREE_PY_DISTRO-$ROS_DISTRO} == "$ROS_DISTRO" ]] &&
    python3 -c 'import rclpy' 2>/dev/null
}

# Leave the environments that this shell may be in, and enter the one on which tf_tree_py is built:
# a sourced ROS 2, otherwise the wheels in the workspace's venv. Sets `world` to its Python.
enter_ros() {
  local prefix prefixes
  leave "$repository/.workspace" "${path_variables[@]}"
  leave "$workspace" "${path_variables[@]}"
  if ros_is_sourced; then
    world=$(command -v python3)
    return
  fi
  # Another distribution, or another clone of this repository: our Python cannot use its modules.
  IFS=: read -ra prefixes <<<"${AMENT_PREFIX_PATH-}"
  for prefix in "${prefixes[@]}"; do leave "$prefix" "${path_variables[@]:1}"; done
  unset "${marks_of_ros[@]}"
  world=$workspace/venv/bin/python
  prepend PATH "$workspace/venv/bin"
  prepend AMENT_PREFIX_PATH "$workspace/venv"
  prepend CMAKE_PREFIX_PATH "$workspace/venv"
}

# copy_sources FOLDER: make FOLDER a copy without git-ignored files, for builds that write into it.
copy_sources() {
  rm -rf "$1"
  mkdir -p "$1"
  git -C "$repository" ls-files -z --cached --others --exclude-standard --deduplicate |
    tar --create --directory "$repository" --ignore-failed-read --null --files-from - 2>/dev/null |
    tar --extract --directory "$1"
}

