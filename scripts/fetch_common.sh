# Shared by the scripts/fetch_*: source it, do not run it.
#
# Such a script sets
#   data_set            what is fetched, for messages
#   licence             text that is shown before a download
#   folder              default name of the output folder
#   parts               rows "name|text or image|archive|address of its folder or file|size|content"; an address
#                       that ends in / is a folder
#   sequence_pattern    extended regular expression of one --sequences entry; empty: no such flag
# and defines
#   part_globs PART [SEQUENCE]   members to unpack, one glob a line, * matches / as well
#   place_part PART STAGING      moves what was unpacked to its place by place_tree
#   say_sources                  what to try next
# and calls fetch_main "$@".
#
# OUT/.fetch holds the state: ARCHIVE.part while downloading, PART.done when a part is in place.
# Exit codes are those in the scripts' headers.
#
# shellcheck shell=bash disable=SC2154

source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$root/scripts/fetch_archive.sh"

out=''
mirror=${SEXTANT_MIRROR:-}
local_archives=''
checksums=$root/scripts/fetch_checksums.txt
attempts=${SEXTANT_FETCH_ATTEMPTS:-5}
wait_s=${SEXTANT_FETCH_WAIT:-5}
accepted=false
keep=false
selected=()
sequences=()
child=''
staging=''

fail() {
  local code=$1
  shift
  printf '%s: %s\n' "scripts/$(basename "$0")" "$*" >&2
  exit "$code"
}

human() { numfmt --to=si --suffix=B "$1"; }

# part_field NAME INDEX (0 name, 1 kind, 2 archive, 3 address, 4 size, 5 content)
part_field() {
  local row fields
  for row in "${parts[@]}"; do
    IFS='|' read -r -a fields <<<"$row"
    if [[ ${fields[0]} == "$1" ]]; then
      printf '%s\n' "${fields[$2]}"
      return
    fi
  done
  return 1
}

part_names() {
  local row
  for row in "${parts[@]}"; do printf '%s\n' "${row%%|*}"; done
}

# part_address NAME: where its archive is; --mirror replaces all but the archive's name.
part_address() {
  local archive address
  archive=$(part_field "$1" 2)
  address=$(part_field "$1" 3)
  if [[ -n $mirror ]]; then
    printf '%s/%s\n' "${mirror%/}" "$archive"
  elif [[ $address == */ ]]; then
    printf '%s%s\n' "$address" "$archive"
  else
    printf '%s\n' "$address"
  fi
}

# Where the archive of a part is kept while it is needed.
archive_path() { printf '%s\n' "$out/.fetch/$(part_field "$1" 2)"; }

list_parts() {
  local name
  printf '%s\n' "$data_set"
  for name in $(part_names); do
    printf '  %-16s %-6s %9s  %s\n' "--$name" "$(part_field "$name" 1)" "$(part_field "$name" 4)" "$(part_field "$name" 5)"
    printf '  %-16s %s\n' '' "$(part_address "$name")"
  done
  printf '%s\n' 'Sizes are approximate, from public notes on these files; - is unknown. The server is asked before a download.'
}

parse_arguments() {
  local name
  while (($# > 0)); do
    case $1 in
      -h | --help) usage; exit 0 ;;
      --list) list_only=true ;;
      --accept-license | --accept-licence) accepted=true ;;
      --keep-archives) keep=true ;;
      --text-only) for name in $(part_names); do [[ $(part_field "$name" 1) != text ]] || selected+=("$name"); done ;;
      --all) mapfile -t selected < <(part_names) ;;
      --out | --mirror | --archives | --checksums | --sequences)
        (($# > 1)) || die "$1 needs a value; see scripts/$(basename "$0") --help"
        set_option "$1" "$2"
        shift ;;
      --*)
        name=${1#--}
        part_field "$name" 0 >/dev/null || die "unknown argument '$1'; see scripts/$(basename "$0") --help"
        selected+=("$name") ;;
      *) die "unknown argument '$1'; see scripts/$(basename "$0") --help" ;;
    esac
    shift
  done
}

set_option() {
  local entry
  case $1 in
    --out) out=$2 ;;
    --mirror) mirror=$2 ;;
    --archives) local_archives=$2 ;;
    --checksums) checksums=$2 ;;
    --sequences)
      [[ -n $sequence_pattern ]] || die "--sequences: $data_set has a single sequence"
      IFS=',' read -r -a sequences <<<"$2"
      for entry in "${sequences[@]}"; do
        [[ $entry =~ ^($sequence_pattern)$ ]] || die "--sequences: '$entry' is none of $data_set: expected $sequence_example"
      done
      ((${#sequences[@]} > 0)) || die "--sequences: expected $sequence_example" ;;
  esac
}

check_values() {
  [[ -z $mirror || $mirror =~ ^https?://[^/] ]] || die "--mirror '$mirror': expected an http:// or https:// address"
  [[ -z $local_archives || -d $local_archives ]] || die "--archives '$local_archives' is not a folder"
  [[ $attempts =~ ^[1-9][0-9]*$ ]] || die "SEXTANT_FETCH_ATTEMPTS='$attempts': expected a number from 1"
  [[ $wait_s =~ ^[0-9]+$ ]] || die "SEXTANT_FETCH_WAIT='$wait_s': expected whole seconds"
  [[ -f $checksums ]] || die "--checksums '$checksums': no such file"
  if ((${#selected[@]} == 0)); then
    local name
    for name in $(part_names); do [[ $(part_field "$name" 1) != text ]] || selected+=("$name"); done
    say "no part named: the text parts (${selected[*]}); --list shows all"
  fi
  mapfile -t selected < <(printf '%s\n' "${selected[@]}" | awk '!seen[$0]++')
}

check_tools() {
  local tool package missing=() needed=(curl:curl tar:tar gzip:gzip unzip:unzip sha256sum:coreutils flock:util-linux)
  for tool in "${needed[@]}"; do
    package=${tool#*:}
    command -v "${tool%%:*}" >/dev/null || missing+=("${tool%%:*} (Debian package $package)")
  done
  ((${#missing[@]} == 0)) || die "missing: ${missing[*]}; install with apt-get install"
}

# covered SEQUENCE DONE-FILE
covered() {
  local have
  have=$(sed -n 's/^sequences //p' "$2")
  [[ " $have " == *' all '* || " $have " == *" $1 "* || " $have " == *" ${1%%/*} "* ]]
}

# complete PART: it is in place, with every sequence that is asked for.
complete() {
  local done_file=$out/.fetch/$1.done sequence path
  [[ -f $done_file ]] || return 1
  [[ $(sed -n 's/^archive //p' "$done_file") == "$(part_field "$1" 2)" ]] || return 1
  if ((${#sequences[@]} == 0)); then
    covered all "$done_file" || return 1
  fi
  for sequence in "${sequences[@]}"; do covered "$sequence" "$done_file" || return 1; done
  while IFS= read -r path; do [[ -e $out/$path ]] || return 1; done < <(sed -n 's/^placed //p' "$done_file")
}

# record PART BYTES SHA256: writes PART.done, adding to what earlier runs have put in place.
record() {
  local done_file=$out/.fetch/$1.done known='' now='all' path
  ((${#sequences[@]} == 0)) || now="${sequences[*]}"
  if [[ -f $done_file ]]; then known=$(sed -n 's/^sequences //p' "$done_file"); fi
  {
    printf 'archive %s\nbytes %s\nsha256 %s\n' "$(part_field "$1" 2)" "$2" "$3"
    printf 'sequences %s\n' "$(tr ' ' '\n' <<<"$known $now" | sed '/^$/d' | sort -u | paste -sd' ')"
    {
      if [[ -f $done_file ]]; then
        while IFS= read -r path; do
          if [[ -e $out/$path ]]; then printf 'placed %s\n' "$path"; fi
        done < <(sed -n 's/^placed //p' "$done_file")
      fi
      cat "$out/.fetch/placed"
    } | sort -u
  } >"$done_file.new"
  mv -f "$done_file.new" "$done_file"
}

# no_link FILE: fails where a folder between $out and FILE is a link; what is fetched stays below $out.
no_link() {
  local part=$out rest=${1#"$out"/}
  while [[ $rest == */* ]]; do
    part+=/${rest%%/*}
    rest=${rest#*/}
    [[ ! -L $part ]] || fail 2 "$part is a link: nothing is placed through it; remove it, or choose another --out"
  done
}

# place_tree SOURCE TARGET: moves a file or folder of the staging folder to its place by renaming, so it
# appears at once and whole. A folder that is there already is kept, and its entries are moved one by one.
place_tree() {
  local source=$1 target=$2 entry
  if [[ -d $source && -d $target && ! -L $target ]]; then
    for entry in "$source"/*; do place_tree "$entry" "$target/${entry##*/}"; done
    return
  fi
  no_link "$target"
  mkdir -p "$(dirname "$target")"
  mv -fT "$source" "$target"
  printf 'placed %s\n' "${target#"$out"/}" >>"$out/.fetch/placed"
}

# find_folders STAGING GLOB: the outermost folders of that name, at most three levels down.
find_folders() { find "$1" -mindepth 1 -maxdepth 3 -name __MACOSX -prune -o -type d -name "$2" -print -prune | sort; }

# place_folders PART STAGING GLOB TARGET: each folder GLOB goes to TARGET/its name.
place_folders() {
  local folders folder
  mapfile -t folders < <(find_folders "$2" "$3")
  ((${#folders[@]} > 0)) || fail 5 "$(part_field "$1" 2) has no folder $3: it is not laid out as published"
  for folder in "${folders[@]}"; do place_tree "$folder" "$4/${folder##*/}"; done
}

ask_licence() {
  printf '%s\n\n' "$licence"
  if $accepted; then
    say 'licence accepted by --accept-license'
    return
  fi
  [[ -t 0 ]] || fail 3 'the licence is not accepted: read it above, then add --accept-license'
  local answer=''
  read -r -p 'Do you accept these terms? Type yes: ' answer || true
  [[ $answer == yes ]] || fail 3 'the licence is not accepted; nothing was downloaded'
}

# run COMMAND...: in the background, so that an interrupt reaches the script at once.
run() {
  local status=0
  "$@" &
  child=$!
  wait "$child" || status=$?
  child=''
  return "$status"
}

clean_up() {
  if [[ -n $child ]]; then
    kill "$child" 2>/dev/null || true
    wait "$child" 2>/dev/null || true
  fi
  if [[ -n $staging ]]; then rm -rf "$staging"; fi
}

interrupted() {
  trap '' INT TERM HUP
  printf '\nscripts/%s: interrupted; run the same command again to go on where it stopped\n' "$(basename "$0")" >&2
  exit 130
}

fetch_part() {
  local name=$1 archive sha256
  archive=$(archive_path "$name")
  local own=true
  if [[ -n $local_archives && -f $local_archives/${archive##*/} ]]; then
    archive=$local_archives/${archive##*/}
    own=false
    say "$name: use $archive"
  elif [[ ! -f $archive ]]; then
    say "$name: download $(part_address "$name")"
    download "$(part_address "$name")" "$archive"
  fi
  sha256=$(checked_sum "$archive" "$own")
  say "$name: $(human "$(stat -c %s "$archive")"), SHA-256 $sha256"
  unpack "$name" "$archive" "$own"
  record "$name" "$(stat -c %s "$archive")" "$sha256"
  if $own && ! $keep; then rm -f "$archive"; fi
}

fetch_main() {
  local name pending=() list_only=false
  parse_arguments "$@"
  if $list_only; then
    list_parts
    exit 0
  fi
  check_values
  check_tools
  out=$(realpath -m "${out:-${SEXTANT_DATA:-data}/$folder}")
  for name in "${selected[@]}"; do
    if complete "$name"; then say "$name: already in $out"; else pending+=("$name"); fi
  done
  if ((${#pending[@]} > 0)); then
    ask_licence
    no_link "$out/.fetch/lock"
    mkdir -p "$out/.fetch" || fail 2 "cannot write to $out"
    exec 9>"$out/.fetch/lock"
    flock -n 9 || fail 2 "another scripts/fetch_* is writing to $out"
    trap clean_up EXIT
    trap interrupted INT TERM HUP
    rm -rf "$out"/.fetch/unpack.*
    shopt -s nullglob dotglob
    for name in "${pending[@]}"; do fetch_part "$name"; done
  fi
  printf '\n'
  say_sources
}
