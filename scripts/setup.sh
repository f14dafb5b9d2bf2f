#!/usr/bin/env bash
# Makes ready what the pipeline needs: system libraries (only those that are missing) and the Python packages of
# requirements.lock in .venv. Calling it again changes nothing and takes a fraction of a second.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PATH="$PATH:/usr/sbin:/sbin"
# The environment is made from the Python outside it, whether it is active or not.
PATH=":$PATH:" && PATH="${PATH//:"$PWD"\/.venv\/bin:/:}" && PATH="${PATH#:}" && PATH="${PATH%:}"

say() { printf 'setup: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# Through a link the environment of another checkout would be emptied, while others may work in it.
[ ! -L .venv ] || fail ".venv is a link to $(readlink .venv): set it up in the checkout that it belongs to"

# --- Python ---------------------------------------------------------------------------------------------------------
python=${PYTHON:-$(command -v python3.11 || command -v python3 || true)}
[ -n "$python" ] || fail "Python 3.11 or newer is needed and not found (Debian: apt-get install python3 python3-venv)"
interpreter=$("$python" -c 'import sys; print(sys.version, sys.base_prefix); sys.exit(sys.version_info < (3, 11))') ||
    fail "Python 3.11 or newer is needed; $python is ${interpreter:-not Python}. Name another one with PYTHON=…"

# --- System libraries -----------------------------------------------------------------------------------------------
missing=()
if command -v ldconfig >/dev/null; then
    libraries=$(ldconfig -p)
    for pair in libusb-1.0.so.0=libusb-1.0-0 libGL.so.1=libgl1 libgomp.so.1=libgomp1; do
        grep -qF "${pair%=*}" <<<"$libraries" || missing+=("${pair#*=}")
    done
fi
if [ ! -x .venv/bin/python ] && ! "$python" -c 'import ensurepip' 2>/dev/null; then
    missing+=(python3-venv)
fi
if [ ${#missing[@]} -gt 0 ]; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    install="apt-get install -y --no-install-recommends ${missing[*]}"
    if ! command -v apt-get >/dev/null; then
        fail "these libraries are missing; install what your system calls them: ${missing[*]}"
    elif [ ${#as_root[@]} -gt 0 ] && ! { command -v sudo && { [ -t 0 ] || sudo -n true; }; } >/dev/null 2>&1; then
        fail "system packages are missing and this user may not install them. Ask for: $install"
    fi
    say "installing ${missing[*]}"
    export DEBIAN_FRONTEND=noninteractive
    "${as_root[@]}" apt-get update -qq
    # shellcheck disable=SC2086
    "${as_root[@]}" $install -qq -o Dpkg::Use-Pty=0 >/dev/null
fi

# --- Python packages ------------------------------------------------------------------------------------------------
# The stamp names everything that the environment was made from, and is written last.
stamp=.venv/made-from
made_from=$({ echo "$interpreter" "$PWD"; cat requirements.lock pyproject.toml; } | sha256sum)
if [ "$(cat "$stamp" 2>/dev/null)" = "$made_from" ]; then
    exit 0
fi
say "making .venv from requirements.lock (some minutes the first time)"
"$python" -m venv --clear .venv
pip=(.venv/bin/python -m pip install -qq --disable-pip-version-check --no-deps)
# The build tool first, so that packages without a wheel are built by the locked one.
"${pip[@]}" --require-hashes -r <(awk '/^setuptools==/ { on = 1 } on { print } on && !/\\$/ { exit }' requirements.lock)
"${pip[@]}" --require-hashes --no-build-isolation -r requirements.lock
"${pip[@]}" --no-build-isolation --editable .
broken=$(.venv/bin/python -m pip check) || fail "$broken"
echo "$made_from" >"$stamp"
say "done"
