# Functions for scripts that test on a fresh system: a minimal Debian or Ubuntu in a folder, made by debootstrap. Source this file
# after common.sh.
#
#   need_bare_root TOOL...  ends the script with exit code 77, and the command that installs what is missing, unless debootstrap, the
#                           TOOLs and the rights of root are available
#   make_trial_root NAME    makes a new root for this script in the folder $trial
#   finish_trial            removes that root, or with $keep prints its folder; done when the script ends
#   make_bare_root DIR      makes a new root in DIR from an archive that the first call stores in the cache
#   in_root DIR COMMAND     runs a command in the root; of the environment it gets only PATH, LANG, HOME and DEBIAN_FRONTEND
#   install_in_root DIR PACKAGE...
#   remove_root DIR
#
# SEXTANT_ROOTS: folder of the cache, default ~/.cache/sextant/roots. SEXTANT_SUITE: default bookworm; jammy and noble are Ubuntu's.
roots=${SEXTANT_ROOTS:-${XDG_CACHE_HOME:-$HOME/.cache}/sextant/roots}
suite=${SEXTANT_SUITE:-bookworm}
mirror=${SEXTANT_MIRROR:-http://deb.debian.org/debian}
components=main how=()
case $suite in
  jammy | noble)
    mirror=${SEXTANT_MIRROR:-http://archive.ubuntu.com/ubuntu}
    components=main,universe
    how=(/usr/share/debootstrap/scripts/gutsy)  # that of all its releases
    ;;
esac

need_bare_root() {
  local missing=() tool
  for tool in debootstrap "$@"; do command -v "$tool" >/dev/null || missing+=("$tool"); done
  if ((${#missing[@]} > 0)); then
    printf 'skipped; what it needs: apt-get install %s\n' "${missing[*]//dpkg-shlibdeps/dpkg-dev}"
    exit 77
  fi
  if ((EUID != 0)); then
    echo "skipped; a root by debootstrap needs root: sudo $(realpath --relative-to="$root" "$0")"
    exit 77
  fi
}

finish_trial() {
  if $keep; then echo "the root: $trial"; elif [[ -n $trial ]]; then remove_root "$trial"; fi
  trial=""
}

make_trial_root() {
  trial=$(mktemp -d)
  trap finish_trial EXIT
  trap 'exit 130' INT TERM
  say "bare root of $1"
  make_bare_root "$trial"
  mkdir -p "$trial/tmp/home"
}

make_bare_root() {
  local root_dir=$1 archive=$roots/$suite.tar
  mkdir -p "$roots/archives/partial" "$roots/lists/partial" "$root_dir"
  mount --bind "$root_dir" "$root_dir"  # so that one command unmounts whatever is mounted below it
  if [[ ! -e $archive ]]; then
    say "debootstrap $suite (once; kept in $archive)"
    logged "$roots/debootstrap.log" debootstrap --variant=minbase --components="$components" --cache-dir="$roots/archives" \
      "$suite" "$root_dir" "$mirror" "${how[@]}"
    rm -rf "$root_dir"/var/cache/apt/archives/*.deb
    tar -C "$root_dir" -cf "$archive.part" . && mv "$archive.part" "$archive"
  else
    tar -C "$root_dir" -xf "$archive"
  fi
  cp -L /etc/resolv.conf "$root_dir/etc/resolv.conf"
  chmod 755 "$root_dir"  # users that are not root come in too
  mount -t proc proc "$root_dir/proc"
  mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root_dir/dev/pts" && ln -sf pts/ptmx "$root_dir/dev/ptmx"
  mount --bind "$roots/archives" "$root_dir/var/cache/apt/archives"  # packages are fetched once
  in_root "$root_dir" apt-get -qq update
}

in_root() {
  local root_dir=$1
  shift
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 HOME=/tmp/home DEBIAN_FRONTEND=noninteractive \
    chroot "$root_dir" "$@"
}

install_in_root() {  # DIR PACKAGE...
  local root_dir=$1
  shift
  # docker-clean and its like do not lie here, so that what was fetched stays for the next root.
  logged "$root_dir/tmp/apt.log" in_root "$root_dir" apt-get -qq -y -o Dpkg::Use-Pty=0 \
    -o APT::Keep-Downloaded-Packages=true install --no-install-recommends "$@"
}

remove_root() {
  umount --recursive --lazy "$1" || die "$1: still mounted, not removed"  # lazily: a process that was stopped may still end
  rm -rf "$1"
}
