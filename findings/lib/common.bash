# Read by every script of this folder: a temporary folder that is removed at the end, pinned installations,
# verdicts.
# shellcheck shell=bash disable=SC2034

# Short: a path of a socket in it has at most 107 bytes.
work=$(mktemp -d /tmp/finding.XXXXXX)
# What the software under trial leaves behind goes with it.
mkdir "$work/tmp"
export TMPDIR=$work/tmp
# Commands to run before the folder is removed, the last one first.
leaving=()
leave() {
    local code=$? i
    trap - EXIT
    for ((i = ${#leaving[@]} - 1; i >= 0; i--)); do
        "${leaving[i]}" || true
    done
    rm -rf -- "$work"
    exit "$code"
}
trap leave EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

say() { printf '%s\n' "$*"; }
# What cannot be tried here: exit code 77.
cannot() {
    say "${0##*/}: not tried: $*" >&2
    exit 77
}
needs() {
    local tool
    for tool in "$@"; do
        command -v "$tool" >/dev/null || cannot "$tool is not installed"
    done
}
# Names the Debian package's version, and tells where it is another than the one that was looked at.
debian() {
    local package=$1 looked_at=$2 here
    here=$(dpkg-query --show --showformat='${Version}' "$package" 2>/dev/null) || here=""
    [ -n "$here" ] || cannot "the Debian package $package ($looked_at) is not installed"
    say "version: $package $here"
    [[ $here == *"$looked_at"* ]] || say "other version than $looked_at: its behaviour may differ"
}
# A virtual environment with these packages and no others but what they need; its python is `$python`.
pip_install() {
    local with=$1
    shift
    needs "$with"
    "$with" -m venv "$work/venv" || cannot "$with has no venv (Debian: python3-venv)"
    "$work/venv/bin/pip" install --quiet --disable-pip-version-check "$@" || cannot "pip did not install $*"
    python=$work/venv/bin/python
    say "version: $* ($("$python" --version))"
}
cargo_head() {
    printf '%s\n' '[package]' 'name = "finding"' 'version = "0.0.0"' 'edition = "2024"' '' '[dependencies]'
}
# The dependencies of a crate whose src/main.rs is stdin; it is built as `$work/crate/target/debug/finding`.
cargo_build() {
    needs cargo cc
    mkdir -p "$work/crate/src"
    cat >"$work/crate/src/main.rs"
    cargo_head >"$work/crate/Cargo.toml"
    printf '%s\n' "$@" >>"$work/crate/Cargo.toml"
    cargo build --quiet --manifest-path "$work/crate/Cargo.toml" --target-dir "$work/crate/target" ||
        cannot "cargo did not build with $*"
    say "version: $*"
}
# An interpreter of Python 3.MINOR is `$interpreter`.
python_of() {
    local candidate
    for candidate in "python3.$1" python3 "$HOME/.pyenv/versions/3.$1".*/bin/python3; do
        if [ "$("$candidate" -c 'import sys; print(sys.version_info[1])' 2>/dev/null)" = "$1" ]; then
            interpreter=$candidate
            return
        fi
    done
    cannot "Python 3.$1 is not installed"
}
# The source of a crate: NAME VERSION. Its folder is `$crate`.
cargo_source() {
    needs cargo
    mkdir -p "$work/source/src"
    touch "$work/source/src/lib.rs"
    cargo_head >"$work/source/Cargo.toml"
    printf '%s = { version = "=%s", default-features = false }\n' "$1" "$2" >>"$work/source/Cargo.toml"
    cargo vendor --quiet --versioned-dirs --manifest-path "$work/source/Cargo.toml" "$work/vendor" \
        >/dev/null || cannot "cargo did not fetch $1 $2"
    crate=$work/vendor/$1-$2
    say "version: $1 $2"
}
# Packages of npm in `$work/node`, without their installation scripts.
npm_install() {
    needs node npm
    npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work/node" "$@" ||
        cannot "npm did not install $*"
    say "version: $* (node $(node --version))"
}
# Vulkan has lavapipe alone.
lavapipe() {
    local drivers=(/usr/share/vulkan/icd.d/lvp_icd.*.json)
    debian mesa-vulkan-drivers 22.3.6
    [ -e "${drivers[0]}" ] || cannot "lavapipe's file in /usr/share/vulkan/icd.d is missing"
    export VK_DRIVER_FILES=${drivers[0]} VK_ICD_FILENAMES=${drivers[0]} XDG_RUNTIME_DIR=$work
}

# Runs a program whose lines `NAME = VALUE` are results; they are shown and kept.
observe() { "$@" | tee -a "$work/seen"; }
seen() { sed -n "s/^$1 = //p" "$work/seen"; }

changed=0
# Compares what came with what was seen when the finding was written: WHAT CAME EXPECTED.
expect() {
    if [ "$2" = "$3" ]; then
        say "as found: $1: $2"
    else
        say "CHANGED: $1: came $2, expected $3"
        changed=1
    fi
}
verdict() {
    if [ "$changed" = 0 ]; then
        say "${0##*/}: confirmed"
    else
        say "${0##*/}: the behaviour has changed"
        exit 1
    fi
}
