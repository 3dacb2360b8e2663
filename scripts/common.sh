# Shared by the scripts of this folder: source it, do not run it.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf '\033[1m==> %s\033[0m\n' "$*" | if [[ -t 1 ]]; then cat; else sed 's/\x1b\[[0-9]*m//g'; fi; }
own_name() { realpath --relative-to="$root" "$0"; }
die() {
  printf '%s: %s\n' "$(own_name)" "$*" >&2
  exit 2
}

# logged LOG COMMAND...: runs a command with its output in LOG. If it fails, prints the end of LOG and ends the script.
logged() {
  local log=$1
  shift
  : >"$log" || die "cannot write $log: use a clone in a folder of your own"
  "$@" >"$log" 2>&1 || { tail -n 40 "$log" >&2; die "failed: $*"; }
}

# arguments NAME... -- "$@": reads the flags of the calling script. A NAME `out=` sets the variable out to the value of --out,
# `keep` sets the variable keep to true, and `bench+` appends the value to the array bench (a '-' in a name becomes '_'). With
# the NAME `words`, arguments that are no flags go to the array words; with `rest`, those after `--` go to the array rest.
# --help prints the help text.
arguments() {
  local known=" " flag name
  while [[ $1 != -- ]]; do known+="$1 "; shift; done
  shift
  words=() rest=()
  while (($# > 0)); do
    flag=$1 name=${1#--}
    shift
    if [[ $flag == -h || $flag == --help ]]; then
      usage
      exit 0
    elif [[ $flag == -- && $known == *" rest "* ]]; then
      rest=("$@")
      return
    elif [[ $flag == --* && $known == *" $name"[=+]" "* ]]; then
      [[ -n ${1:-} ]] || die "$flag needs a value; see $(own_name) --help"
      if [[ $known == *" $name= "* ]]; then printf -v "${name//-/_}" %s "$1"; else eval "${name//-/_}+=(\"\$1\")"; fi
      shift
    elif [[ $flag == --* && $known == *" $name "* ]]; then
      printf -v "${name//-/_}" true
    elif [[ $flag != -* && $known == *" words "* ]]; then
      words+=("$flag")
    else
      die "unknown argument '$flag'; see $(own_name) --help"
    fi
  done
}

# Prints the comment block at the top of the calling script, which is its help text.
usage() { sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"; }

# Prints the number of parallel compilers: SEXTANT_JOBS, otherwise one per core, but at most one per 1.5 GB of available memory
# (the largest sources need over 1 GB).
build_jobs() {
  local cores by_memory
  cores=$(nproc)
  by_memory=$(awk '/^MemAvailable:/ { n = int($2 / 1500000); print n < 1 ? 1 : n }' /proc/meminfo)
  echo "${SEXTANT_JOBS:-$((cores < by_memory ? cores : by_memory))}"
}

# build_preset PRESET [TARGET...]: configures quietly, with ${configure_options[@]}, and builds with a progress line.
configure_options=()
build_preset() {
  local preset=$1 log=$root/build/$1-configure.log
  shift
  mkdir -p "$root/build" || die "cannot write $root/build: use a clone in a folder of your own"
  say "configure build/$preset"
  logged "$log" env -C "$root" cmake --preset "$preset" "${configure_options[@]}"
  sed -n 's/^-- \(Python package: not built.*\)/\1/p' "$log"  # so that an option kept in CMake's cache does not pass unnoticed
  say "build build/$preset with $(build_jobs) jobs"
  local command=(cmake --build "$root/build/$preset" -j "$(build_jobs)")
  if (($# > 0)); then command+=(--target "$@"); fi
  export NINJA_STATUS='[%f/%t, %e s] '
  if [[ -t 1 ]]; then
    "${command[@]}"
  else
    # In a pipe ninja prints a line per step: keep every 25th, and everything that is not a step.
    "${command[@]}" 2>&1 | awk '/^\[[0-9]+\/[0-9]+, / { if (++n % 25 == 0) { print; fflush() } last = $0; next }
                                { print; fflush() } END { if (last) print last }'
  fi
}
