# Steps of .ci/run and .ci/full: sourced by them. Each step is measured, and the table of seconds precedes pytest's summary.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=${PYTHON:-$(command -v python3.11 || command -v python3)}
"$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' ||
    echo "warning: $("$python" --version) is not the Python 3.11 this is tested with" >&2

work=$(mktemp -d)
jobs_started=()
trap 'kill "${jobs_started[@]}" 2>/dev/null || true; rm -rf "$work"' EXIT
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_PROGRESS_BAR=off
export MPLBACKEND=Agg MPLCONFIGDIR="$work/matplotlib"
# Users have Python's byte-code cache.
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV PYTHONDONTWRITEBYTECODE

# step NAME COMMAND...: run a command, and write down what it took.
step() {
    local name=$1 start=$SECONDS
    shift
    printf '\n== %s (at %d s)\n' "$name" "$SECONDS"
    "$@"
    printf '%6d s  %s\n' $((SECONDS - start)) "$name" >>"$work/seconds"
}

# begin LABEL FUNCTION: run a function with its steps beside what follows; finish LABEL waits for it and shows its output.
begin() {
    (set -e; "$2") >"$work/$1.log" 2>&1 &
    jobs_started+=($!)
    printf -v "job_$1" %d $!
}
finish() {
    local job="job_$1" passed=true
    wait "${!job}" || passed=false
    cat "$work/$1.log"
    "$passed"
}

# The tests, as the last step: then the table, and then pytest's last line once more.
test_last() {
    local passed=true start=$SECONDS
    printf '\n== tests (at %d s)\n' "$SECONDS"
    # Not a step: `set -e` would end it at a failure, and the table is most wanted then.
    "$@" 2>&1 | tee "$work/pytest.log" || passed=false
    printf '%6d s  tests\n' $((SECONDS - start)) >>"$work/seconds"
    printf '\n== seconds\n'
    cat "$work/seconds"
    printf '%6d s  all\n' "$SECONDS"
    tail -n 1 "$work/pytest.log"
    "$passed"
}

# uv makes the same environments of the same wheels in a fifth of pip's time. It reads no settings of pip's: where they
# are needed pip takes its turn.
get_uv() {
    "$python" -m venv "$work/uv"
    "$work/uv/bin/pip" install --quiet uv || true
}
# install ENVIRONMENT WORDS...: what pip would install there.
install() {
    local folder=$1
    shift
    UV_FIND_LINKS=${PIP_FIND_LINKS:-} UV_PYTHON_DOWNLOADS=never "$work/uv/bin/uv" pip install --quiet \
        --python "$folder/bin/python" "$@" || "$folder/bin/pip" install --quiet --no-compile "$@"
}

# find_python VERSION: a Python of this version, on the path or among those of pyenv.
find_python() {
    local other
    for other in "$(command -v "python$1" || true)" "$HOME/.pyenv/versions/$1".*/bin/python; do
        if "$other" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$1')" 2>/dev/null; then
            echo "$other"
            return
        fi
    done
}
# try_python VERSION PROGRAM: both commands of the README, without pybullet, and the tests that tell Pythons apart.
try_python() {
    "$2" -m venv "$work/$1"
    install "$work/$1" --only-binary :all: --no-binary osimlite -e '.[dev]'
    "$work/$1/bin/osimlite" demo -o "$work/demo-$1" </dev/null
    "$work/$1/bin/pytest" -n1 tests/test_readme.py tests/test_windows.py tests/simulation/test_run.py \
        tests/simulation/test_compiled.py tests/io/document/upgrade tests/io/document/test_{any_model,plugins}.py
    rm -rf "${work:?}/$1"
}

build_and_validate() {
    (cd "$work" && "$1/osimlite" build dynamic-walker -o walker.osim && "$1/osimlite" validate walker.osim)
}
