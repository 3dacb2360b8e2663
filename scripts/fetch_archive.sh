# Downloading, checking and unpacking one archive, for fetch_common.sh.
#
# shellcheck shell=bash disable=SC2154

# header NAME FILE: the value of a header in the last answer of a dump by curl.
header() {
  awk -v name="$1" '
    { sub(/\r$/, "") }
    /^HTTP\// { value = "" }
    { colon = index($0, ":") }
    colon && tolower(substr($0, 1, colon - 1)) == name { value = substr($0, colon + 1); sub(/^[ \t]+/, "", value) }
    END { print value }' "$2"
}

http_status() { awk '/^HTTP\// { status = $2 } END { print status }' "$1"; }

# curl_to ADDRESS ARGUMENT...: an https address is never left for an http one.
curl_to() {
  local address=$1 redirects='=http,https'
  shift
  if [[ $address == https://* ]]; then redirects='=https'; fi
  run curl --fail --location --proto '=http,https' --proto-redir "$redirects" --connect-timeout 30 \
    --speed-limit 1 --speed-time 60 "$@" -- "$address"
}

# explain CURL-EXIT HTTP-STATUS ADDRESS: says why a download failed. Returns 1 where trying again cannot help.
explain() {
  case $1 in
    6) why="the name of the server in $3 is not known: is there a network, or a proxy to set (https_proxy)?" ;;
    7) why="no connection to the server of $3: is there a network, or a proxy to set (https_proxy)?" ;;
    18 | 52 | 55 | 56) why="the connection to $3 was cut" ;;
    23) why="cannot write to $out: is the disk full?"; return 1 ;;
    28) why="$3 did not answer in time" ;;
    35 | 51 | 58 | 60 | 77) why="no secure connection to $3: are the clock right and ca-certificates installed?"; return 1 ;;
    22)
      why="$3: the server answered with HTTP status ${2:-unknown}"
      case $2 in
        404 | 410) why+=' (no such file): it may have moved; see its page, --mirror and --archives'; return 1 ;;
        401 | 403) why+=' (no permission): see its page, --mirror and --archives'; return 1 ;;
        5?? | 408 | 425 | 429) ;;
        *) return 1 ;;
      esac ;;
    *) why="$3: curl ended with exit code $1" ;;
  esac
}

need_space() {  # need_space BYTES FOR-WHAT
  local free
  free=$(df --output=avail -B1 "$out" | tail -n 1)
  (($1 <= free)) || fail 6 "$2 needs $(human "$1"), and $out has $(human "$free") free"
}

# ask_server ADDRESS PART-FILE: sets expected_size ('' where the server does not say) and drops a partial
# download of another version of the file.
ask_server() {
  local answer=$2.head status=0 version
  expected_size=''
  : >"$answer"
  curl_to "$1" --silent --head --output "$answer" || status=$?
  case $status:$(http_status "$answer") in
    0:*) ;;
    22:403 | 22:405 | 22:5??) rm -f "$answer"; return ;;  # servers that answer GET only
    *) head_status=$(http_status "$answer"); rm -f "$answer"; refusal=$status; return 1 ;;
  esac
  expected_size=$(header content-length "$answer")
  [[ $expected_size =~ ^[0-9]+$ ]] || expected_size=''
  version="size $expected_size, etag $(header etag "$answer"), date $(header last-modified "$answer")"
  rm -f "$answer"
  if [[ -f $2 && -f $2.version && $(<"$2.version") != "$version" ]]; then
    say 'the file on the server has changed: start again'
    rm -f "$2"
  fi
  printf '%s\n' "$version" >"$2.version"
}

# download ADDRESS FILE: resumes FILE.part, and renames it to FILE when its size is what the server says.
download() {
  local address=$1 file=$2 part=$2.part attempt why='' expected_size='' head_status='' refusal=0 status have
  for ((attempt = 1; attempt <= attempts; ++attempt)); do
    if ((attempt > 1)); then
      say "$why; try again ($attempt of $attempts)"
      run sleep "$wait_s" || true
    fi
    if ! ask_server "$address" "$part"; then
      explain "$refusal" "$head_status" "$address" || fail 4 "$why"
      continue
    fi
    status=0
    download_once "$address" "$part" || status=$?
    if ((status == 0)); then
      have=$(stat -c %s "$part")
      if [[ -z $expected_size || $have == "$expected_size" ]]; then
        mv -f "$part" "$file"
        rm -f "$part.version"
        return
      fi
      why="$address: $have bytes came, and the server says $expected_size"
    else
      explain "$status" "$get_status" "$address" || fail "$([[ $status == 23 ]] && echo 6 || echo 4)" "$why"
    fi
  done
  have=$(stat -c %s "$part" 2>/dev/null || echo 0)
  fail 4 "$why; gave up after $attempts attempts. $(human "$have") are kept: run the same command again to go on"
}

download_once() {
  local address=$1 part=$2 have status=0 show=(--silent)
  have=$(stat -c %s "$part" 2>/dev/null || echo 0)
  if [[ -n $expected_size ]]; then
    if ((have > expected_size)); then
      rm -f "$part"
      have=0
    fi
    need_space "$((expected_size - have))" "the download"
    if ((have == expected_size && have > 0)); then return 0; fi
  elif ((have == 0)); then
    say 'the server does not say the size: free space is not checked before the download'
  fi
  if ((have > 0)); then say "go on after $(human "$have")"; fi
  if [[ -t 2 ]]; then show=(--progress-bar); fi
  : >"$part.head"
  curl_to "$address" "${show[@]}" --continue-at "$have" --dump-header "$part.head" --output "$part" || status=$?
  get_status=$(http_status "$part.head")
  rm -f "$part.head"
  # 33: the server sends the whole file only. 416: it does not know the place to go on from.
  if ((have > 0)) && [[ $status == 33 || $get_status == 416 ]]; then
    say 'the server cannot go on in the middle of a file: start again'
    rm -f "$part"
    download_once "$address" "$part"
    return
  fi
  return "$status"
}

# refuse ARCHIVE OWN WHY: sets a downloaded archive aside, so that the next run downloads it again.
refuse() {
  if [[ $2 == true ]]; then
    mv -f "$1" "$1.rejected"
    fail 5 "$3. It is kept as $1.rejected; nothing was unpacked"
  fi
  fail 5 "$3. Nothing was unpacked"
}

# pinned NAME ALGORITHM: the sum of an archive in the list of known sums, or nothing.
pinned() {
  awk -v name="$1" -v algorithm="$2" -v file="$checksums" '
    /^[ \t]*(#|$)/ { next }
    NF != 3 || ($1 != "md5" && $1 != "sha256") || $2 !~ /^[0-9a-f]+$/ || length($2) != ($1 == "md5" ? 32 : 64) {
      printf "%s:%d: expected: md5 or sha256, the sum in hexadecimal, the name of the archive\n", file, NR > "/dev/stderr"
      exit 1
    }
    $3 == name && $1 == algorithm { print $2 }' "$checksums"
}

# checked_sum ARCHIVE OWN: prints the SHA-256, after comparison with the known sums.
checked_sum() {
  local name=${1##*/} algorithm want got sha256
  sha256=$(sha256sum <"$1" | cut -d' ' -f1)
  for algorithm in md5 sha256; do
    want=$(pinned "$name" "$algorithm") || exit 2
    [[ -n $want ]] || continue
    got=$sha256
    if [[ $algorithm == md5 ]]; then got=$(md5sum <"$1" | cut -d' ' -f1); fi
    [[ $got == "$want" ]] || refuse "$1" "$2" \
      "$name has the $algorithm sum $got, and $checksums says $want: it is damaged, or was replaced by its publisher"
  done
  printf '%s\n' "$sha256"
}

# list_members ARCHIVE LIST: writes "type bytes name" per member, and reads the archive to its end. Fails where
# the archive is damaged.
list_members() {
  if [[ $1 == *.zip ]]; then
    run unzip -tqq "$1" >"$2.log" 2>&1 || return
    run unzip -Zs "$1" >"$2.raw" 2>"$2.log" || return
    awk 'NF >= 9 && /^[-dlbcps?]/ { line = $0; for (i = 1; i <= 8; ++i) sub(/^[^ ]+ +/, "", line)
                                    print substr($1, 1, 1), $4, line }' "$2.raw" >"$2"
  else
    run env LC_ALL=C tar --no-seek --numeric-owner --quoting-style=escape -tvf "$1" >"$2.raw" 2>"$2.log" || return
    awk '{ line = $0; for (i = 1; i <= 5; ++i) sub(/^[^ ]+ +/, "", line)
           print substr($1, 1, 1), $3, line }' "$2.raw" >"$2"
  fi
}

# Prints the first member that could be written outside of the folder, or is neither a file nor a folder.
unsafe_member() {
  awk '{ type = $1; name = $0; sub(/^[^ ]+ [^ ]+ /, "", name) }
       type !~ /^[-d?]$/ || name ~ /^\// || name ~ /(^|\/)\.\.(\/|$)/ || name ~ /\\/ { print name; exit }' "$1"
}

# Globs of part_globs as one extended regular expression a line.
globs_to_expressions() { sed -e 's/[.+(){}|^$\\]/\\&/g' -e 's/\*/.*/g' -e 's/?/./g' -e 's/^/^/' -e 's/$/$/'; }

# wanted_globs PART LIST ARCHIVE OWN: the globs that match a member. Fails where one of the sequences has none.
wanted_globs() {
  local name=$1 sequence glob found globs=() names=$2.names
  sed -E 's/^[^ ]+ [^ ]+ //' "$2" >"$names"
  for sequence in "${sequences[@]:-}"; do
    found=false
    while IFS= read -r glob; do
      if grep -qE -e "$(globs_to_expressions <<<"$glob")" "$names"; then
        found=true
        globs+=("$glob")
      fi
    done < <(part_globs "$name" "$sequence")
    $found || fail 5 "${3##*/} holds nothing of ${sequence:-$data_set}"
  done
  printf '%s\n' "${globs[@]}"
}

# unpack PART ARCHIVE OWN: into a temporary folder beside the target, then by renaming into place.
unpack() {
  local name=$1 archive=$2 list=$out/.fetch/members status=0 unsafe globs bytes
  rm -f "$list"*
  list_members "$archive" "$list" || refuse "$archive" "$3" \
    "${archive##*/} is truncated or no archive at all ($(head -n 1 "$list.log" | cut -c1-200))"
  unsafe=$(unsafe_member "$list")
  [[ -z $unsafe ]] || refuse "$archive" "$3" "${archive##*/} has an unsafe member: $unsafe"
  wanted_globs "$name" "$list" "$archive" "$3" >"$list.globs"
  mapfile -t globs <"$list.globs"
  bytes=$(grep -E -f <(printf '%s\n' "${globs[@]}" | globs_to_expressions | sed 's/^^/^[^ ]+ [^ ]+ /') "$list" |
    awk '$1 != "d" { sum += $2 } END { printf "%.0f", sum }')
  need_space "$bytes" "unpacking ${archive##*/}"
  say "$name: unpack $(human "$bytes")"
  staging=$(mktemp -d "$out/.fetch/unpack.XXXXXX")
  local files=$staging/files
  mkdir "$files"
  if [[ $archive == *.zip ]]; then
    run unzip -qq -o "$archive" "${globs[@]}" -d "$files" >"$list.log" 2>&1 || status=$?
  else
    run env LC_ALL=C tar --no-same-owner --no-same-permissions --wildcards --wildcards-match-slash -xf "$archive" \
      -C "$files" "${globs[@]}" >"$list.log" 2>&1 || status=$?
  fi
  ((status == 0)) || fail 5 "cannot unpack ${archive##*/}: $(head -n 1 "$list.log" | cut -c1-200)"
  chmod -R u+rwX "$files"  # follows no link
  # What the list of a zip says of a member depends on the system it names; what was unpacked is a file, a folder, or neither.
  unsafe=$(find "$files" ! -type f ! -type d -printf '%P\n' -quit)
  [[ -z $unsafe ]] || refuse "$archive" "$3" "${archive##*/} has an unsafe member: $unsafe"
  : >"$out/.fetch/placed"
  place_part "$name" "$files"
  rm -rf "$staging"
  staging=''
  rm -f "$list"*
}
